"""Least squares of a plane in inverse depth, 1/Z = a x + b y + c, within a gate around the plane of before."""

from __future__ import annotations

import numpy as np

from ibvs_qp.vision.kernels.compile import kernel
from ibvs_qp.vision.kernels.labels import BOARD, PAINT

#: Smallest determinant of the normal matrix, share of the product of its diagonal.
_FLAT = 1e-6
#: Planes are held in front of the camera: least 1/Z [1/m].
_FARTHEST = 1e-3


@kernel("Tuple((f8[::1], b1[::1]))(f8[:, ::1], f8[::1], b1[::1], u1[::1], f8[::1], b1, f8, f8, i8)")
def choose_samples(
    design: np.ndarray,
    inverse: np.ndarray,
    usable: np.ndarray,
    labels: np.ndarray,
    plane: np.ndarray,
    own_depth: bool,
    gate: float,
    paint_gate: float,
    least: int,
) -> tuple[np.ndarray, np.ndarray]:
    """Samples near a plane, those of the surface's colours alone where they are enough.

    Args:
        design: Columns x, y, 1 of the samples, normalised, (n, 3).
        inverse: 1/Z [1/m], (n,).
        usable: Samples with a reading that the vehicle does not hide, (n,).
        labels: Colour labels, (n,), or (0,) where colours are unknown.
        plane: (a, b, c), (3,).
        own_depth: Whether distances are shares of the samples' depth instead of the plane's.
        gate: Greatest distance, share of depth.
        paint_gate: Gate of what looks like paint, share of the board's.
        least: Fewest samples of the surface's colours.

    Returns:
        Distances from the plane [shares of depth], undefined where not usable, (n,), and the chosen samples, (n,).
    """
    relative = np.empty(len(inverse))
    near = np.zeros(len(inverse), np.bool_)
    colored = np.zeros(len(inverse), np.bool_)
    count = 0
    for i in range(len(inverse)):
        if not usable[i]:
            continue
        at = design[i, 0] * plane[0] + design[i, 1] * plane[1] + design[i, 2] * plane[2]
        relative[i] = (inverse[i] / max(at, _FARTHEST) if own_depth else at / inverse[i]) - 1.0
        away = abs(relative[i])
        near[i] = away < gate
        if near[i] and labels.size > 0:
            colored[i] = labels[i] == BOARD or (labels[i] == PAINT and away < paint_gate * gate)
            count += colored[i]
    return relative, colored if labels.size > 0 and count >= least else near


@kernel("Tuple((b1, f8[::1], f8[:, ::1]))(f8[:, ::1], f8[::1], b1[::1])")
def fit_plane(design: np.ndarray, inverse: np.ndarray, chosen: np.ndarray) -> tuple[bool, np.ndarray, np.ndarray]:
    """Least squares over chosen samples, by cofactors.

    Args:
        design: Columns x, y, 1 of the samples, normalised, (n, 3).
        inverse: 1/Z [1/m], (n,).
        chosen: Samples of the surface, (n,).

    Returns:
        Whether the samples determine a plane, (a, b, c), (3,), and the inverse of the normal matrix, (3, 3).
    """
    xx = xy = x = yy = y = one = xd = yd = d = 0.0
    for i in range(len(inverse)):
        if not chosen[i]:
            continue
        u, v, w = design[i, 0], design[i, 1], inverse[i]
        xx, xy, x, yy, y, one = xx + u * u, xy + u * v, x + u, yy + v * v, y + v, one + 1.0
        xd, yd, d = xd + u * w, yd + v * w, d + w
    normal = np.empty((3, 3))
    normal[0, 0] = yy * one - y * y
    normal[0, 1] = normal[1, 0] = x * y - xy * one
    normal[0, 2] = normal[2, 0] = xy * y - x * yy
    normal[1, 1] = xx * one - x * x
    normal[1, 2] = normal[2, 1] = xy * x - xx * y
    normal[2, 2] = xx * yy - xy * xy
    determinant = xx * normal[0, 0] + xy * normal[0, 1] + x * normal[0, 2]
    scale, plane = 1.0 / determinant, np.empty(3)
    for row in range(3):
        for column in range(3):
            normal[row, column] *= scale
        plane[row] = normal[row, 0] * xd + normal[row, 1] * yd + normal[row, 2] * d
    return determinant >= _FLAT * xx * yy * one, plane, normal


@kernel("UniTuple(f8, 2)(f8[:, ::1], f8[::1], b1[:, ::1], f8[::1], i8)")
def residual_squares(
    design: np.ndarray, inverse: np.ndarray, component: np.ndarray, plane: np.ndarray, block: int
) -> tuple[float, float]:
    """Squares of the residuals of a plane, and of their sums over blocks: residuals that hold together add up there.

    Args:
        design: Columns x, y, 1 of the samples, normalised, (rows * columns, 3).
        inverse: 1/Z [1/m], (rows * columns,).
        component: Samples of the surface, (rows, columns).
        plane: (a, b, c), (3,).
        block: Side of a block [samples].

    Returns:
        Sum of the squares over samples and over blocks [1/m^2].
    """
    rows, columns = component.shape
    residual = np.zeros((rows, columns))
    total = blocks = 0.0
    for r in range(rows):
        for c in range(columns):
            if component[r, c]:
                i = r * columns + c
                at = design[i, 0] * plane[0] + design[i, 1] * plane[1] + design[i, 2] * plane[2]
                residual[r, c] = inverse[i] - at
                total += residual[r, c] * residual[r, c]
    for top in range(0, rows - block + 1, block):
        for left in range(0, columns - block + 1, block):
            together = 0.0
            for r in range(top, top + block):
                for c in range(left, left + block):
                    together += residual[r, c]
            blocks += together * together
    return total, blocks
