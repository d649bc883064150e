"""One frame as the line code wants it: colour, mask and camera, with a transposed view for upright lines."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ibvs_qp.vision.config import REFERENCE_WIDTH
from ibvs_qp.vision.mask import Intrinsics


@dataclass(frozen=True, kw_only=True)
class Picture:
    """A colour picture with the vehicle's mask.

    Attributes:
        rgb: uint8 (H, W, 3).
        mask: uint8 (H, W), non-zero where the vehicle hides the view.
        intrinsics: (fx, fy, cx, cy) [px].
        scale: Factor for settings in pixels of a 640 wide picture.
    """

    rgb: np.ndarray
    mask: np.ndarray
    intrinsics: Intrinsics
    scale: float

    @classmethod
    def of(cls, rgb: np.ndarray, mask: np.ndarray, intrinsics: Intrinsics) -> Picture:
        """Wrap a picture, its scale taken from its width."""
        return cls(rgb=rgb, mask=mask, intrinsics=intrinsics, scale=max(rgb.shape[:2]) / REFERENCE_WIDTH)

    @property
    def transposed(self) -> Picture:
        """View with rows and columns swapped (no copy): upright lines become level."""
        fx, fy, cx, cy = self.intrinsics
        return Picture(rgb=self.rgb.transpose(1, 0, 2), mask=self.mask.T, intrinsics=(fy, fx, cy, cx), scale=self.scale)


def pixel_line(rho: float, theta: float, intrinsics: Intrinsics) -> tuple[float, float, float]:
    """Coefficients (p, q, r) of the line p u + q v + r = 0 in pixels."""
    fx, fy, cx, cy = intrinsics
    p, q = math.cos(theta) / fx, math.sin(theta) / fy
    return p, q, -rho - p * cx - q * cy


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
