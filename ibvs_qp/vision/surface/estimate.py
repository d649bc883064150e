"""The fitted surface: its description, the connected part of the picture it fills, its covariance."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np

from ibvs_qp.vision.config import PlaneConfig
from ibvs_qp.vision.picture.grid import CoarseGrid


@dataclass(frozen=True, kw_only=True)
class PlaneEstimate:
    """A fitted surface in the camera frame.

    Attributes:
        inverse_depth: (a, b, c) of 1/Z = a x + b y + c [1/m], (3,).
        covariance: Of (a, b, c), correlated noise and the frame's common mode included, (3, 3).
        normal: Outward unit normal (towards the camera) in C, (3,).
        distance_m: Distance of the camera centre from the plane [m].
        inlier_share: Share of the valid samples of the whole picture that belong to the surface.
        residual_sigma: Standard deviation of the residuals, share of depth.
        component: Samples of the surface, bool (rows, columns) of the coarse grid.
    """

    inverse_depth: np.ndarray
    covariance: np.ndarray
    normal: np.ndarray
    distance_m: float
    inlier_share: float
    residual_sigma: float
    component: np.ndarray

    @property
    def abcd(self) -> tuple[float, float, float, float]:
        """Plane (A, B, C, D) with D = -1."""
        a, b, c = (float(entry) for entry in self.inverse_depth)
        return a, b, c, -1.0


def surface_problem(plane: np.ndarray, down: np.ndarray | None, config: PlaneConfig) -> str | None:
    """Why a fitted (a, b, c) cannot be the surface, or None; ``down`` is gravity's direction in C, (3,), if known."""
    a, b, c = plane.tolist()
    length = math.hypot(a, b, c)
    upright = c > math.cos(math.radians(config.max_oblique_deg)) * length
    if down is not None:
        upright &= abs(float(plane @ down)) < math.sin(math.radians(config.max_lean_deg)) * length
    if not upright:
        return "the surface does not stand upright or does not face the camera"
    if not config.distance_min_m <= 1.0 / length <= config.distance_max_m:
        return f"the surface lies {1.0 / length:.2f} m away, out of range"
    return None


def connected_samples(inlier: np.ndarray, grid: CoarseGrid, seed: tuple[int, int] | None) -> np.ndarray:
    """Connected inliers around the seed (the largest, without one); hidden samples connect."""
    _, labels = cv2.connectedComponents((inlier | ~grid.free).view(np.uint8), connectivity=4, ltype=cv2.CV_16U)
    if seed is not None:
        rows, columns = grid.window(seed, 2)
        around = labels[rows, columns][inlier[rows, columns]]
        counts = np.bincount(around) if len(around) else np.zeros(1)
    else:
        counts = np.bincount(labels.ravel().take(np.flatnonzero(inlier)), minlength=1)
    label = int(np.argmax(counts))
    return inlier & (labels == label) if counts[label] > 0 else np.zeros_like(inlier)


def plane_covariance(
    plane: np.ndarray,
    normal_matrix_inverse: np.ndarray,
    squares: tuple[float, float],
    count: int,
    common_mode_m: float,
) -> np.ndarray:
    """Least-squares covariance, inflated by the correlation of the residuals over blocks, plus the common mode.

    Args:
        plane: (a, b, c), (3,).
        normal_matrix_inverse: Inverse of the normal matrix, (3, 3).
        squares: Sum of the squares of the residuals, and of their sums over blocks [1/m^2].
        count: Samples of the surface.
        common_mode_m: Depth error common to one frame [m].

    Returns:
        Covariance of (a, b, c), (3, 3).
    """
    total, blocks = squares
    inflation = max(1.0, blocks / total) if total > 0.0 else 1.0
    variance = total / max(count - 3.0, 1.0) * inflation
    common = common_mode_m**2 * float(plane @ plane)
    return normal_matrix_inverse * variance + plane[:, None] * plane * common
