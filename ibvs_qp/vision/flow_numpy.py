"""What native/flow.c computes, with numpy: where there is no machine code, and to say what it is."""

from __future__ import annotations

import math

import cv2
import numpy as np

from ibvs_qp.vision.mask import Intrinsics
from ibvs_qp.vision.normal_equations import solve_three
from ibvs_qp.vision.robust import MAD_TO_SIGMA, median

#: Rounds of reweighting.
_ROUNDS = 4
#: Columns of the system: what is seen, after velocity (0 to 2) and before turn (4 to 6).
_SEEN = 3


def root_with_numpy(
    grey: np.ndarray, points: np.ndarray, reach: int, floor: float, noise: float, error: float
) -> np.ndarray:
    """Square roots of the information of points; arguments as for `ibvs_qp.vision.native_flow.root_natively`."""
    gx = cv2.Sobel(grey, cv2.CV_32F, 1, 0, ksize=3, scale=0.125)
    gy = cv2.Sobel(grey, cv2.CV_32F, 0, 1, ksize=3, scale=0.125)
    steps = np.arange(-reach, reach + 1)
    rows = np.clip(np.round(points[:, 1]).astype(np.intp)[:, None] + steps, 0, grey.shape[0] - 1)[:, :, None]
    columns = np.clip(np.round(points[:, 0]).astype(np.intp)[:, None] + steps, 0, grey.shape[1] - 1)[:, None, :]
    patch = np.stack((gx[rows, columns], gy[rows, columns]), axis=-1).reshape(len(points), -1, 2).astype(float)
    values, vectors = np.linalg.eigh(patch.transpose(0, 2, 1) @ patch)
    values = np.maximum(values - floor, 0.0) / noise
    values = np.sqrt(values / (1.0 + values * error))
    return (vectors * values[:, None, :]) @ vectors.transpose(0, 2, 1)


def depths_with_numpy(
    bearings: np.ndarray,
    depth: np.ndarray,
    intrinsics: Intrinsics,
    plane: np.ndarray | None,
    gate: float,
    cross: int,
    least: int,
) -> np.ndarray:
    """1/Z of normalised points; arguments as for `ibvs_qp.vision.native_flow.depths_natively`."""
    (height, width), (fx, fy, cx, cy) = depth.shape, intrinsics
    place = np.rint(bearings * (fx, fy) + (cx, cy)).astype(np.intp)
    place = np.minimum(np.maximum(place, cross), (width - 1 - cross, height - 1 - cross))
    steps = np.array([0, -cross, cross, -cross * width, cross * width])
    z = depth.reshape(-1).take((place @ np.array((1, width)))[:, None] + steps)
    good = (z > 0) & (z < np.inf)  # false for NaN too
    count = np.count_nonzero(good, axis=1)
    z[~good] = np.inf
    z.sort(axis=1)  # the median of the valid ones is at half their count
    middle = z[np.arange(len(z)), np.minimum(count // 2, len(steps) - 1)]
    inverse = (1.0 / middle) * (count >= least)
    if plane is not None:
        a, b, c = plane
        surface = bearings @ (a, b) + c
        near = (inverse > 0) & (np.abs(inverse - surface) < gate * np.abs(surface))
        inverse = np.where(near, surface, inverse)
    return inverse


def solve_with_numpy(
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
    """Robust weighted least squares; arguments and results as for `ibvs_qp.vision.native_flow.solve_natively`."""
    rows, squares = _system(still, end, inverse, root * scale, interval)
    width = rows.shape[2]
    weight = np.ones(len(rows))
    sums, velocity, size = np.zeros((width, width)), (0.0, 0.0, 0.0), weight
    for _ in range(_ROUNDS):
        sums = (weight @ squares).reshape(width, width)
        (xx, xy, xz, xs), (_, yy, yz, ys), (_, _, zz, zs) = sums[:3, :4].tolist()
        solved = solve_three((xx + prior, xy, xz, yy + prior, yz, zz + prior), (xs, ys, zs))
        if solved is None:
            return None
        velocity = solved[0]
        answer = np.array((*velocity, -1.0, 0.0, 0.0, 0.0))
        residual = rows @ answer
        size = np.vecdot(residual, residual)
        spread = max(MAD_TO_SIGMA * math.sqrt(median(size)), 0.5)
        weight = np.maximum(0.0, 1.0 - size * (1.0 / (gate_sigmas * spread) ** 2)) ** 2
    agreeing = float(np.count_nonzero(weight > 0.1))
    return [*velocity, float(weight @ size), float(weight.sum()), agreeing], sums


def _system(
    still: np.ndarray, end: np.ndarray, inverse: np.ndarray, whiten: np.ndarray, interval: float
) -> tuple[np.ndarray, np.ndarray]:
    """Whitened rows of every point, (n, 2, 7), and their products, (n, 49): velocity (3), what is seen (1), turn (3).

    The products are summed with changing weights, so each is made once.
    """
    x, y = (0.5 * (end + still)).T
    rows = np.zeros((len(x), 2, 7))
    rows[:, 0, 0] = rows[:, 1, 1] = -inverse
    rows[:, 0, 2], rows[:, 1, 2] = inverse * x, inverse * y
    rows[:, :, _SEEN] = (end - still) * (1.0 / interval)
    cross = x * y
    rows[:, 0, 4], rows[:, 1, 5] = cross, -cross
    rows[:, 0, 5], rows[:, 0, 6] = -(1.0 + x * x), y
    rows[:, 1, 4], rows[:, 1, 6] = 1.0 + y * y, -x
    rows = whiten @ rows
    return rows, (rows.transpose(0, 2, 1) @ rows).reshape(len(x), -1)
