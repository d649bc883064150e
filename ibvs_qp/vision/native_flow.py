"""Velocity from followed points by machine code: fills in the tables of native/flow.c and reads them."""

from __future__ import annotations

import ctypes

import numpy as np

from ibvs_qp.vision.native import place

#: Numbers per point of the whitened system, and columns of its sums: velocity (3), what is seen (1), turn (3).
_ROW, _WIDTH = 14, 7


def solve_natively(
    library: ctypes.CDLL,
    still: np.ndarray,
    end: np.ndarray,
    inverse: np.ndarray,
    root: np.ndarray,
    *,
    scale: float,
    interval: float,
    prior: float,
    gate_sigmas: float,
) -> tuple[list[float], np.ndarray] | None:
    """Robust weighted least squares, see `ibvs_qp.vision.flow_solve.solve_velocity`.

    Args:
        library: The machine code.
        still: Points after the turn alone, normalised, (n, 2).
        end: Points as found, normalised, (n, 2).
        inverse: 1/Z of the points [1/m], (n,).
        root: Square roots of their information [1/px], (n, 2, 2).
        scale: What turns these into those of a velocity [px s].
        interval: Time between the pictures [s].
        prior: Information of the prior [s2/m2].
        gate_sigmas: Residuals beyond so many robust sigmas get no weight.

    Returns:
        Velocity (3), sum of weighted squares, sum of weights and points that agree, and the sums of products (7, 7) of
        the last round; None where the points determine no velocity.
    """
    count = len(still)
    settings = np.array((count, scale, interval, prior, gate_sigmas), float)
    parts = [np.ascontiguousarray(part, float) for part in (still, end, inverse, root)]
    scratch = np.empty((_ROW + 3) * count)
    rows, weight, size, values = np.split(scratch, (_ROW * count, (_ROW + 1) * count, (_ROW + 2) * count))
    out, sums = np.empty(6), np.empty((_WIDTH, _WIDTH))
    places = (settings, *parts, rows, weight, size, values, out, sums)
    if not library.solve_flow(*(place(part) for part in places)):
        return None
    return out.tolist(), sums


def depths_natively(
    library: ctypes.CDLL,
    bearings: np.ndarray,
    depth: np.ndarray,
    intrinsics: tuple[float, float, float, float],
    plane: np.ndarray | None,
    gate: float,
    cross: int,
    least: int,
) -> np.ndarray:
    """1/Z of normalised points, see `ibvs_qp.vision.flow_solve.inverse_depths`, (n,).

    Args:
        library: The machine code.
        bearings: The points, (n, 2).
        depth: Depth [m], (H, W).
        intrinsics: (fx, fy, cx, cy) [px].
        plane: (a, b, c) of the surface, or None.
        gate: A point this near to it lies on it, share of 1/Z.
        cross: Distance of the four further places at which the depth of a point is read [px].
        least: How many readings must be valid.
    """
    bearings, depth = np.ascontiguousarray(bearings, float), np.ascontiguousarray(depth, np.float32)
    camera, inverse = np.array(intrinsics, float), np.empty(len(bearings))
    plane = None if plane is None else np.ascontiguousarray(plane, float)
    library.flow_depths(
        place(bearings),
        len(bearings),
        place(depth),
        *depth.shape,
        place(camera),
        place(plane),
        ctypes.c_double(gate),
        cross,
        least,
        place(inverse),
    )
    return inverse


def root_natively(
    library: ctypes.CDLL, grey: np.ndarray, points: np.ndarray, reach: int, floor: float, noise: float, error: float
) -> np.ndarray:
    """Square roots of the information that following each point carries [1/px], symmetric, (n, 2, 2).

    Args:
        library: The machine code.
        grey: The picture, uint8 (H, W).
        points: Places [px], float32 (n, 2).
        reach: Half width of the window [px].
        floor: What noise alone makes of the structure tensor [grey levels squared].
        noise: Variance of the picture [grey levels squared].
        error: Variance of a followed point that structure cannot lower [px2].
    """
    roots, points = np.empty((len(points), 2, 2)), np.ascontiguousarray(points, np.float32)
    library.flow_information(
        place(grey),
        *(ctypes.c_long(size) for size in grey.shape),
        place(points),
        len(points),
        reach,
        *(ctypes.c_double(number) for number in (floor, noise, error)),
        place(roots),
    )
    return roots
