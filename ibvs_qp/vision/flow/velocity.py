"""Velocity of the camera from followed points, by robust weighted least squares."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ibvs_qp.frames import R_BODY_CAMERA
from ibvs_qp.vision.compilation import inner, kernel
from ibvs_qp.vision.config import FlowConfig
from ibvs_qp.vision.medians import MAD_TO_SIGMA, upper_median

#: Rounds of reweighting.
_ROUNDS = 4
#: Columns of the system: velocity (0 to 2), flow, turn (4 to 6).
_WIDTH, _FLOW = 7, 3
_V, _TURN = slice(0, 3), slice(4, 7)
#: Points of less weight do not agree.
_AGREES = 0.1


@dataclass(frozen=True, kw_only=True)
class FlowVelocity:
    """Velocity of the centre of mass."""

    velocity: np.ndarray  # in B, at the middle of the two captures [m/s], (3,)
    covariance: np.ndarray  # (3, 3); large in directions that nothing showed
    stamp_ns: int  # time for which it holds
    points: int  # points that agreed


def solve_velocity(
    still: np.ndarray,
    end: np.ndarray,
    inverse: np.ndarray,
    root: np.ndarray,
    focal: float,
    interval: float,
    turn: np.ndarray,
    camera_position: np.ndarray,
    config: FlowConfig,
) -> FlowVelocity | str:
    """Robust weighted least squares for the camera's velocity after the full rotational flow is taken out.

    Args:
        still: Points after the turn alone, normalised, (n, 2).
        end: Points as found, normalised, (n, 2).
        inverse: 1/Z of the points [1/m], (n,).
        root: Square roots of their information [1/px], (n, 2, 2).
        focal: Focal length of the picture in which they were followed [px].
        interval: Time between the pictures [s].
        turn: Turn of the body in between, in B [rad], (3,).
        camera_position: Camera centre in B [m], (3,).
        config: Settings.

    Returns:
        The velocity, or the reason why it is missing.
    """
    prior = 1.0 / config.prior_m_s**2
    velocity, sums, square, total, agreeing = _robust_velocity(
        still, end, inverse, root, focal * interval, interval, prior, config.gate_sigmas
    )
    if not len(velocity):
        return "the points determine no velocity"
    if agreeing < config.min_points:
        return "too few points agree"
    if math.hypot(*velocity) > config.speed_max_m_s:
        return "faster than possible"
    spread = max(square / max(2.0 * total - 3.0, 1.0), 1.0)
    spreads = np.array((1.0, spread))[:, None, None]
    with_prior, spread_out = np.linalg.inv(sums[:, _V] + np.eye(3) * prior / spreads) * spreads
    leak = with_prior @ sums[:, _TURN] * (config.rotation_sigma_rad / interval)
    covariance = spread_out + leak @ leak.T
    covariance = R_BODY_CAMERA @ covariance @ R_BODY_CAMERA.T
    (wx, wy, wz), (px, py, pz) = (turn / interval).tolist(), camera_position.tolist()
    lever = np.array([wy * pz - wz * py, wz * px - wx * pz, wx * py - wy * px])
    return FlowVelocity(
        velocity=R_BODY_CAMERA @ velocity - lever,
        covariance=0.5 * (covariance + covariance.T),
        stamp_ns=0,
        points=agreeing,
    )


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
        along[_FLOW] = (end[i, 0] - still[i, 0]) / interval
        across[_FLOW] = (end[i, 1] - still[i, 1]) / interval
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
    xs, ys, zs = sums[0, _FLOW], sums[1, _FLOW], sums[2, _FLOW]
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
def _robust_velocity(
    still: np.ndarray,
    end: np.ndarray,
    inverse: np.ndarray,
    root: np.ndarray,
    scale: float,
    interval: float,
    prior: float,
    gate_sigmas: float,
) -> tuple[np.ndarray, np.ndarray, float, float, int]:
    """Velocity of the camera in C [m/s], (3,), empty where the points determine none.

    `scale` turns the roots of the points' information into those of a velocity [px s], `prior` is the information of
    the prior [s2/m2]; the other arguments are those of `solve_velocity`.

    Returns:
        The velocity; weighted sums of the products of its columns with those of velocity, flow and turn in the last
        round, (3, 7); sum of weighted squares, sum of weights and points that agree.
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
                residual = row[0] * velocity[0] + row[1] * velocity[1] + row[2] * velocity[2] - row[_FLOW]
                size[i] += residual * residual
        spread = max(0.5, MAD_TO_SIGMA * math.sqrt(upper_median(size.copy(), len(size)))) * gate_sigmas
        for i in range(len(rows)):
            left = max(0.0, 1.0 - size[i] / (spread * spread))
            weight[i] = left * left
    square, total, agreeing = 0.0, 0.0, 0
    for i in range(len(rows)):
        square, total, agreeing = square + weight[i] * size[i], total + weight[i], agreeing + (weight[i] > _AGREES)
    return velocity, sums, square, total, agreeing
