"""From followed points to a velocity: information of a point, its depth, robust weighted least squares."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ibvs_qp.frames import R_BODY_CAMERA
from ibvs_qp.vision.config import FlowConfig
from ibvs_qp.vision.kernels.flow import robust_velocity
from ibvs_qp.vision.kernels.flow_points import information_roots, point_depths
from ibvs_qp.vision.picture.mask import Intrinsics

#: A point within this many residual sigmas of the surface takes the surface's depth, which is far less noisy.
_ON_PLANE_SIGMAS = 4.0
#: Sum of squares of a 3x3 Sobel kernel over 8^2: variance of its answer per variance of the picture.
_SOBEL_NOISE = 12.0 / 64.0
#: Distance of the four further places at which the depth of a point is read, and how many must be valid [px].
_CROSS_PX, _READINGS = 2, 3
#: Columns of the sums of `solve_velocity`: velocity and turn.
_V, _TURN = slice(0, 3), slice(4, 7)
_NO_SURFACE = np.empty(0)


@dataclass(frozen=True, kw_only=True)
class FlowVelocity:
    """Velocity of the centre of mass.

    Attributes:
        velocity: In B, at the middle of the two captures [m/s], (3,).
        covariance: (3, 3); large in directions that nothing showed.
        stamp_ns: Time for which it holds.
        points: Points that agreed.
    """

    velocity: np.ndarray
    covariance: np.ndarray
    stamp_ns: int
    points: int


class FlowSurface(NamedTuple):
    """The working surface, as far as flow needs it.

    Attributes:
        inverse_depth: (a, b, c) of 1/Z = a x + b y + c, (3,).
        residual_sigma: Standard deviation of its residuals, share of depth.
    """

    inverse_depth: np.ndarray
    residual_sigma: float


def half_resolution(intrinsics: Intrinsics) -> Intrinsics:
    """Camera of the picture at half resolution (2x2 means: pixel centres shift by half a pixel)."""
    fx, fy, cx, cy = intrinsics
    return 0.5 * fx, 0.5 * fy, 0.5 * (cx - 0.5), 0.5 * (cy - 0.5)


def information_root(grey: np.ndarray, points: np.ndarray, config: FlowConfig) -> np.ndarray:
    """Square roots of the information that following each point carries [1/px], symmetric, (n, 2, 2).

    Information is the structure tensor over the window, noise removed, per noise variance, with a floor on the
    error that structure cannot lower: along a lone edge it vanishes (aperture).
    """
    variance = config.grey_sigma**2
    floor = 2.0 * config.window_px**2 * _SOBEL_NOISE * variance
    return information_roots(grey, points, config.window_px // 2, floor, variance, config.pixel_sigma**2)


def inverse_depths(
    bearings: np.ndarray, depth: np.ndarray, intrinsics: Intrinsics, plane: FlowSurface | None
) -> np.ndarray:
    """1/Z of normalised points (n, 2): the surface's where they lie on it, else their own, 0 if unknown, (n,)."""
    surface, gate = _NO_SURFACE, 0.0
    if plane is not None:
        surface = np.ascontiguousarray(plane.inverse_depth, float)
        gate = max(_ON_PLANE_SIGMAS * float(plane.residual_sigma), 0.01)
    depth = np.require(depth, np.float32, ("C", "W"))  # the one type of the kernel
    return point_depths(bearings, depth, np.array(intrinsics, float), surface, gate, _CROSS_PX, _READINGS)


def unturned(bearings: np.ndarray, rotation: np.ndarray) -> np.ndarray:
    """Where normalised points would be now if the camera had only turned (now to before, (3, 3)), (n, 2)."""
    turned = bearings @ rotation[:2] + rotation[2]  # p^T R
    return turned[:, :2] / turned[:, 2:]


def expected_points(
    still: np.ndarray, inverse: np.ndarray, velocity: np.ndarray, interval: float, intrinsics: Intrinsics
) -> np.ndarray:
    """Pixels of turned points after the camera moved at a velocity in C (3,), float32 (n, 2)."""
    fx, fy, cx, cy = intrinsics
    moved = still + (interval * inverse)[:, None] * (still * velocity[2] - velocity[:2])
    return (moved * (fx, fy) + (cx, cy)).astype(np.float32)


def solve_velocity(
    still: np.ndarray,
    end: np.ndarray,
    inverse: np.ndarray,
    root: np.ndarray,
    focal: float,
    interval: float,
    rotation: np.ndarray,
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
        rotation: Turn of the body in between, in B [rad], (3,).
        camera_position: Camera centre in B [m], (3,).
        config: Settings.

    Returns:
        The velocity, or the reason why there is none.
    """
    prior = 1.0 / config.prior_m_s**2
    velocity, sums, square, total, agreeing = robust_velocity(
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
    (wx, wy, wz), (px, py, pz) = (rotation / interval).tolist(), camera_position.tolist()
    lever = np.array([wy * pz - wz * py, wz * px - wx * pz, wx * py - wy * px])
    return FlowVelocity(
        velocity=R_BODY_CAMERA @ velocity - lever,
        covariance=0.5 * (covariance + covariance.T),
        stamp_ns=0,
        points=agreeing,
    )
