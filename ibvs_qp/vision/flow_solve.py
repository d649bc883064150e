"""From followed points to a velocity: information of a point, its depth, robust weighted least squares."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np

from ibvs_qp.frames import R_BODY_CAMERA
from ibvs_qp.vision.config import FlowConfig
from ibvs_qp.vision.mask import Intrinsics
from ibvs_qp.vision.plane import PlaneEstimate
from ibvs_qp.vision.robust import median

#: A point within this many residual sigmas of the surface takes the surface's depth, which is far less noisy.
_ON_PLANE_SIGMAS = 4.0
#: Rounds of reweighting.
_ROUNDS = 4
_MAD = 1.4826
#: Sum of squares of a 3x3 Sobel kernel over 8^2: variance of its answer per variance of the picture.
_SOBEL_NOISE = 12.0 / 64.0
#: Columns and rows at which the depth of a point is read, from its place [px].
_CROSS = np.array([[0, -2, 0, 2, 0], [-2, 0, 0, 0, 2]])


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


def half_resolution(intrinsics: Intrinsics) -> Intrinsics:
    """Camera of the picture at half resolution (2x2 means: pixel centres shift by half a pixel)."""
    fx, fy, cx, cy = intrinsics
    return 0.5 * fx, 0.5 * fy, 0.5 * (cx - 0.5), 0.5 * (cy - 0.5)


def information_root(grey: np.ndarray, points: np.ndarray, config: FlowConfig) -> np.ndarray:
    """Square roots of the information that following each point carries [1/px], symmetric, (n, 2, 2).

    Information is the structure tensor over the window, noise removed, per noise variance, with a floor on the
    error that structure cannot lower: along a lone edge it vanishes (aperture).
    """
    if len(points) == 0:
        return np.zeros((0, 2, 2))
    gx = cv2.Sobel(grey, cv2.CV_32F, 1, 0, ksize=3, scale=0.125)
    gy = cv2.Sobel(grey, cv2.CV_32F, 0, 1, ksize=3, scale=0.125)
    reach = config.window_px // 2
    steps = np.arange(-reach, reach + 1)
    rows = np.clip(np.round(points[:, 1]).astype(np.intp)[:, None] + steps, 0, grey.shape[0] - 1)[:, :, None]
    columns = np.clip(np.round(points[:, 0]).astype(np.intp)[:, None] + steps, 0, grey.shape[1] - 1)[:, None, :]
    patch = np.stack((gx[rows, columns], gy[rows, columns]), axis=-1).reshape(len(points), -1, 2).astype(float)
    values, vectors = np.linalg.eigh(patch.transpose(0, 2, 1) @ patch)
    variance = config.grey_sigma**2
    values = np.maximum(values - 2.0 * config.window_px**2 * _SOBEL_NOISE * variance, 0.0) / variance
    values = np.sqrt(values / (1.0 + values * config.pixel_sigma**2))
    return (vectors * values[:, None, :]) @ vectors.transpose(0, 2, 1)


def inverse_depths(
    points: np.ndarray, depth: np.ndarray, intrinsics: Intrinsics, plane: PlaneEstimate | None
) -> np.ndarray:
    """1/Z of points at half resolution: the surface's where they lie on it, else their own, 0 if unknown, (n,)."""
    if len(points) == 0:
        return np.zeros(0)
    full = 2.0 * points.astype(float) + 0.5
    place = np.round(full).astype(np.intp)
    rows = np.minimum(np.maximum(place[:, 1, None] + _CROSS[1], 0), depth.shape[0] - 1)
    columns = np.minimum(np.maximum(place[:, 0, None] + _CROSS[0], 0), depth.shape[1] - 1)
    z = depth[rows, columns].astype(float)
    good = (z > 0) & (z < np.inf)  # false for NaN too
    count = np.count_nonzero(good, axis=1)
    ordered = np.sort(np.where(good, z, np.inf), axis=1)  # the median of the valid ones is at half their count
    middle = ordered[np.arange(len(points)), np.minimum(count // 2, 4)]
    inverse = np.where(count >= 3, 1.0 / middle, 0.0)
    if plane is not None:
        fx, fy, cx, cy = intrinsics
        a, b, c = plane.inverse_depth
        surface = a * (full[:, 0] - cx) / fx + b * (full[:, 1] - cy) / fy + c
        gate = max(_ON_PLANE_SIGMAS * plane.residual_sigma, 0.01)
        inverse = np.where((inverse > 0) & (np.abs(inverse - surface) < gate * np.abs(surface)), surface, inverse)
    return inverse


def unturned(points: np.ndarray, intrinsics: Intrinsics, rotation: np.ndarray) -> np.ndarray:
    """Where points would be now if the camera had only turned (now to before, (3, 3)): normalised, (n, 2)."""
    fx, fy, cx, cy = intrinsics
    a, b, c = rotation  # rows: p^T R = x a + y b + c
    x, y = (points[:, :1] - cx) / fx, (points[:, 1:] - cy) / fy
    turned = x * a + y * b + c
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
    now: np.ndarray,
    inverse: np.ndarray,
    root: np.ndarray,
    intrinsics: Intrinsics,
    interval: float,
    rotation: np.ndarray,
    camera_position: np.ndarray,
    config: FlowConfig,
) -> FlowVelocity | str:
    """Robust weighted least squares for the camera's velocity after the full rotational flow is taken out.

    Args:
        still: Points after the turn alone, normalised, (n, 2).
        now: Points as found, pixels at half resolution, (n, 2).
        inverse: 1/Z of the points [1/m], (n,).
        root: Square roots of their information [1/px], (n, 2, 2).
        intrinsics: Of the half-resolution picture.
        interval: Time between the pictures [s].
        rotation: Turn of the body in between, in B [rad], (3,).
        camera_position: Camera centre in B [m], (3,).
        config: Settings.

    Returns:
        The velocity, or the reason why there is none.
    """
    fx, fy, cx, cy = intrinsics
    end = (now - (cx, cy)) / (fx, fy)
    x, y = (0.5 * (end + still)).T
    whiten = root * (fx * interval)
    translating = np.zeros((len(x), 2, 3))
    translating[:, 0, 0] = translating[:, 1, 1] = -inverse
    translating[:, 0, 2], translating[:, 1, 2] = inverse * x, inverse * y
    rows = (whiten @ translating).reshape(-1, 3)
    wanted = (whiten @ ((end - still) / interval)[:, :, None]).ravel()
    prior = np.eye(3) / config.prior_m_s**2
    velocity, normal = np.zeros(3), prior
    weight = np.ones(len(x))
    size, weighted = weight, rows
    for _ in range(_ROUNDS):
        weighted = rows * np.repeat(weight, 2)[:, None]
        normal = weighted.T @ rows + prior
        velocity = np.linalg.solve(normal, weighted.T @ wanted)
        residual = (wanted - rows @ velocity).reshape(-1, 2)
        size = np.sqrt(np.vecdot(residual, residual))
        scale = max(_MAD * median(size), 0.5)
        weight = np.maximum(0.0, 1.0 - (size * (1.0 / (config.gate_sigmas * scale))) ** 2) ** 2
    agreeing = int(np.count_nonzero(weight > 0.1))
    if agreeing < config.min_points:
        return "too few points agree"
    if math.hypot(*velocity) > config.speed_max_m_s:
        return "faster than possible"
    spread = max(float(weight @ (size * size)) / max(2.0 * float(weight.sum()) - 3.0, 1.0), 1.0)
    turning = np.empty((len(x), 2, 3))
    turning[:, 0, 0] = x * y
    turning[:, 1, 1] = -turning[:, 0, 0]
    turning[:, 0, 1], turning[:, 0, 2] = -(1.0 + x * x), y
    turning[:, 1, 0], turning[:, 1, 2] = 1.0 + y * y, -x
    leak = np.linalg.solve(normal, weighted.T @ (whiten @ turning).reshape(-1, 3))
    leak *= config.rotation_sigma_rad / interval
    covariance = np.linalg.inv(normal - prior * (1.0 - 1.0 / spread)) * spread + leak @ leak.T
    covariance = R_BODY_CAMERA @ covariance @ R_BODY_CAMERA.T
    (wx, wy, wz), (px, py, pz) = rotation / interval, camera_position
    lever = np.array([wy * pz - wz * py, wz * px - wx * pz, wx * py - wy * px])
    return FlowVelocity(
        velocity=R_BODY_CAMERA @ velocity - lever,
        covariance=0.5 * (covariance + covariance.T),
        stamp_ns=0,
        points=agreeing,
    )
