"""Velocity of the camera from followed points, by robust weighted least squares."""

from __future__ import annotations

import math

import numpy as np

from ibvs_qp.vision.kernels.compile import inner, kernel
from ibvs_qp.vision.kernels.median import upper_median
from ibvs_qp.vision.robust import MAD_TO_SIGMA

#: Rounds of reweighting.
_ROUNDS = 4
#: Columns of the system: velocity (0 to 2), what is seen, turn (4 to 6).
_WIDTH, _SEEN = 7, 3
#: Points of less weight do not agree.
_AGREES = 0.1


@inner
def _rows(
    still: np.ndarray, end: np.ndarray, inverse: np.ndarray, root: np.ndarray, scale: float, interval: float
) -> np.ndarray:
    """Whitened rows of every point, (n, 2, 7)."""
    rows, along, across = np.empty((len(still), 2, _WIDTH)), np.empty(_WIDTH), np.empty(_WIDTH)
    for i in range(len(still)):
        x, y = 0.5 * (end[i, 0] + still[i, 0]), 0.5 * (end[i, 1] + still[i, 1])
        along[0], along[1], along[2] = -inverse[i], 0.0, inverse[i] * x
        across[0], across[1], across[2] = 0.0, -inverse[i], inverse[i] * y
        along[_SEEN] = (end[i, 0] - still[i, 0]) / interval
        across[_SEEN] = (end[i, 1] - still[i, 1]) / interval
        along[4], along[5], along[6] = x * y, -(1.0 + x * x), y
        across[4], across[5], across[6] = 1.0 + y * y, -x * y, -x
        for r in range(2):
            for c in range(_WIDTH):
                rows[i, r, c] = scale * (root[i, r, 0] * along[c] + root[i, r, 1] * across[c])
    return rows


@inner
def _solved(sums: np.ndarray, prior: float, velocity: np.ndarray) -> bool:
    """Velocity from the sums of products (3, 7) by cofactors; false where they determine none."""
    xx, xy, xz = sums[0, 0] + prior, sums[0, 1], sums[0, 2]
    yy, yz, zz = sums[1, 1] + prior, sums[1, 2], sums[2, 2] + prior
    c_xx, c_xy, c_xz = yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy
    c_yy, c_yz, c_zz = xx * zz - xz * xz, xy * xz - xx * yz, xx * yy - xy * xy
    determinant = xx * c_xx + xy * c_xy + xz * c_xz
    scale = 1.0 / determinant
    xs, ys, zs = sums[0, _SEEN], sums[1, _SEEN], sums[2, _SEEN]
    velocity[0] = scale * c_xx * xs + scale * c_xy * ys + scale * c_xz * zs
    velocity[1] = scale * c_xy * xs + scale * c_yy * ys + scale * c_yz * zs
    velocity[2] = scale * c_xz * xs + scale * c_yz * ys + scale * c_zz * zs
    return determinant != 0.0


@inner
def _sum_products(rows: np.ndarray, weight: np.ndarray, sums: np.ndarray) -> None:
    """Weighted sums of the products of rows (n, 2, 7): those of velocity with all, (3, 7)."""
    sums[:] = 0.0
    for i in range(len(rows)):
        if weight[i] == 0.0:
            continue
        for r in range(2):
            row = rows[i, r]
            for a in range(3):
                for b in range(_WIDTH):
                    sums[a, b] += weight[i] * row[a] * row[b]


@kernel("Tuple((f8[::1], f8[:, ::1], f8, f8, i8))(f8[:, ::1], f8[:, ::1], f8[::1], f8[:, :, ::1], f8, f8, f8, f8)")
def robust_velocity(
    still: np.ndarray,
    end: np.ndarray,
    inverse: np.ndarray,
    root: np.ndarray,
    scale: float,
    interval: float,
    prior: float,
    gate_sigmas: float,
) -> tuple[np.ndarray, np.ndarray, float, float, int]:
    """Velocity of the camera by robust weighted least squares.

    Args:
        still: Points after the turn alone, normalised, (n, 2).
        end: Points as found, normalised, (n, 2).
        inverse: 1/Z of the points [1/m], (n,).
        root: Square roots of their information [1/px], (n, 2, 2).
        scale: What turns these into those of a velocity [px s].
        interval: Time between the pictures [s].
        prior: Information of the prior [s2/m2].
        gate_sigmas: Residuals beyond so many robust sigmas get no weight.

    Returns:
        Velocity in C [m/s], (3,), empty where the points determine none; weighted sums of the products of its columns
        with those of velocity, what is seen, and turn in the last round, (3, 7); sum of weighted squares, sum of
        weights and points that agree.
    """
    rows, velocity, sums = _rows(still, end, inverse, root, scale, interval), np.empty(3), np.empty((3, _WIDTH))
    weight, size = np.ones(len(rows)), np.empty(len(rows))
    for _ in range(_ROUNDS):
        _sum_products(rows, weight, sums)
        if not _solved(sums, prior, velocity):
            return np.empty(0), sums, 0.0, 0.0, 0
        for i in range(len(rows)):
            size[i] = 0.0
            for r in range(2):
                row = rows[i, r]
                residual = row[0] * velocity[0] + row[1] * velocity[1] + row[2] * velocity[2] - row[_SEEN]
                size[i] += residual * residual
        spread = max(0.5, MAD_TO_SIGMA * math.sqrt(upper_median(size.copy(), len(size)))) * gate_sigmas
        for i in range(len(rows)):
            left = max(0.0, 1.0 - size[i] / (spread * spread))
            weight[i] = left * left
    square, total, agreeing = 0.0, 0.0, 0
    for i in range(len(rows)):
        square, total, agreeing = square + weight[i] * size[i], total + weight[i], agreeing + (weight[i] > _AGREES)
    return velocity, sums, square, total, agreeing
