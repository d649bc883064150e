"""One frame for the search and fit of lines: colour, mask, depth, camera and surface."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ibvs_qp.vision.config import REFERENCE_WIDTH
from ibvs_qp.vision.picture.mask import Intrinsics


@dataclass(frozen=True, kw_only=True)
class Picture:
    """A colour picture with the vehicle's mask, depth and surface."""

    rgb: np.ndarray  # the picture itself, uint8 (H, W, 3)
    mask: np.ndarray  # non-zero where the vehicle hides the view, uint8 (H, W)
    intrinsics: Intrinsics  # (fx, fy, cx, cy) [px]
    scale: float  # factor for settings in pixels of a 640 wide picture
    depth: np.ndarray | None = None  # depth [m], float32 (H, W), or None
    plane: tuple[float, float, float] | None = None  # (a, b, c) of the working surface, or None

    @classmethod
    def of(
        cls,
        rgb: np.ndarray,
        mask: np.ndarray,
        intrinsics: Intrinsics,
        depth: np.ndarray | None = None,
        plane: np.ndarray | None = None,
    ) -> Picture:
        """Wrap a picture, its scale taken from its longer side."""
        return cls(
            rgb=np.ascontiguousarray(rgb),
            mask=np.ascontiguousarray(mask),
            intrinsics=(float(intrinsics[0]), float(intrinsics[1]), float(intrinsics[2]), float(intrinsics[3])),
            scale=max(mask.shape) / REFERENCE_WIDTH,
            depth=None if depth is None else np.ascontiguousarray(depth, np.float32),
            plane=None if plane is None else (float(plane[0]), float(plane[1]), float(plane[2])),
        )


def normalised_line(p: float, q: float, r: float, intrinsics: Intrinsics) -> tuple[float, float]:
    """(rho, theta) of the pixel line p u + q v + r = 0."""
    fx, fy, cx, cy = intrinsics
    a, b, c = p * fx, q * fy, p * cx + q * cy + r
    length = math.hypot(a, b)
    return -c / length, math.atan2(b, a)


def normalise(pixels: np.ndarray, intrinsics: Intrinsics) -> np.ndarray:
    """Normalised coordinates of pixels (..., 2)."""
    fx, fy, cx, cy = intrinsics
    return (pixels - np.array([cx, cy])) / np.array([fx, fy])


def denormalise(points: np.ndarray, intrinsics: Intrinsics) -> np.ndarray:
    """Pixels of normalised coordinates (..., 2)."""
    fx, fy, cx, cy = intrinsics
    return points * np.array([fx, fy]) + np.array([cx, cy])
