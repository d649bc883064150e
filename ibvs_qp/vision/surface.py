"""The fitted surface: its description, the connected part of the picture it fills, its covariance."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np

from ibvs_qp.vision.config import PlaneConfig
from ibvs_qp.vision.grid import CoarseGrid

#: Side of the blocks over which residuals are averaged to measure their correlation [cells].
BLOCK = 8


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
    residual: np.ndarray,
    normal_matrix: np.ndarray,
    count: int,
    grid: CoarseGrid,
    plane: np.ndarray,
    common_mode: float,
) -> np.ndarray:
    """Least-squares covariance, inflated by the correlation of the residuals over blocks, plus the common mode."""
    rows, columns = (size // BLOCK for size in grid.shape)
    square = residual.reshape(grid.shape)[: rows * BLOCK, : columns * BLOCK]
    sums = square.reshape(rows, BLOCK, columns, BLOCK).sum(axis=(1, 3))
    total = float(np.vdot(residual, residual))
    inflation = max(1.0, float(np.vdot(sums, sums)) / total) if total > 0 else 1.0
    variance = total / max(count - 3, 1)
    inverse_length = math.hypot(*plane)
    return (
        np.linalg.inv(normal_matrix) * variance * inflation
        + np.outer(plane, plane) * (common_mode * inverse_length) ** 2
    )
