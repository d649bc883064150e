"""One frame for the search and fit of lines: colour, mask and camera, with a transposed view for upright lines."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ibvs_qp.vision.config import REFERENCE_WIDTH
from ibvs_qp.vision.picture.mask import Intrinsics


@dataclass(frozen=True, kw_only=True)
class Picture:
    """A colour picture with the vehicle's mask; a transposed view shares the data and costs nothing.

    Attributes:
        rgb: The picture itself, uint8 (H, W, 3).
        mask: Non-zero where the vehicle hides the view, uint8 (H, W).
        height: Rows of this view.
        width: Columns of this view.
        row_step: Flat distance of rows of this view.
        column_step: Flat distance of columns of this view.
        intrinsics: (fx, fy, cx, cy) of this view [px].
        scale: Factor for settings in pixels of a 640 wide picture.
        depth: Depth of every pixel [m], (H W,), or None.
        plane: (a, b, c) of the working surface in this view, or None.
    """

    rgb: np.ndarray
    mask: np.ndarray
    height: int
    width: int
    row_step: int
    column_step: int
    intrinsics: Intrinsics
    scale: float
    depth: np.ndarray | None = None
    plane: tuple[float, float, float] | None = None

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
        height, width = mask.shape
        return cls(
            rgb=np.ascontiguousarray(rgb),
            mask=np.ascontiguousarray(mask),
            height=height,
            width=width,
            row_step=width,
            column_step=1,
            intrinsics=intrinsics,
            scale=max(height, width) / REFERENCE_WIDTH,
            depth=None if depth is None else np.ascontiguousarray(depth).ravel(),
            plane=None if plane is None else (float(plane[0]), float(plane[1]), float(plane[2])),
        )

    @cached_property
    def transposed(self) -> Picture:
        """View with rows and columns swapped: upright lines become level."""
        fx, fy, cx, cy = self.intrinsics
        return replace(
            self,
            height=self.width,
            width=self.height,
            row_step=self.column_step,
            column_step=self.row_step,
            intrinsics=(fy, fx, cy, cx),
            plane=None if self.plane is None else (self.plane[1], self.plane[0], self.plane[2]),
        )

    @cached_property
    def surface(self) -> tuple[float, float, float]:
        """(p, q, r) of the surface over pixels of the view, 1/Z = p u + q v + r; zero if it is unknown."""
        if self.plane is None:
            return 0.0, 0.0, 0.0
        (a, b, c), (fx, fy, cx, cy) = self.plane, self.intrinsics
        return a / fx, b / fy, c - a * cx / fx - b * cy / fy


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
