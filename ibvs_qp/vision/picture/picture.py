"""One frame for the stages: exposure levelled, with mask, grid, depth and camera."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np

from ibvs_qp.vision.config import REFERENCE_WIDTH
from ibvs_qp.vision.medians import middle
from ibvs_qp.vision.picture.layout import Intrinsics

#: Pictures of less than this scale are searched at full resolution.
_SMALL = 0.9
#: Brightness of two pictures is compared at every so many pixels, below this grey value: saturated ones do not change.
_COMPARED, _UNSATURATED = 16, 250
#: Least fraction of these pixels that must be unsaturated in both pictures.
_LEAST = 0.05
#: A relative change of brightness from picture to picture below this one is no step: motion and noise look like it [-].
_STEP = 0.03
#: Time in which the learnt colours follow a new exposure by themselves [s].
_FADE_S = 5.0
#: Pictures farther apart than this are not compared [s].
_LONGEST_GAP = 0.2


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


class ExposureSteps:
    """Gain of the exposure since the colours were learnt.

    A step changes all pixels by one factor between two pictures; the camera's motion does not. Colours are compared on
    pictures at the exposure before the step, and the gain fades as they follow.

    Attributes:
        gain: Brightness of the present picture over that of the reference.
    """

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Forget the picture before."""
        self.gain, self._stamp_ns = 1.0, 0
        self._last: np.ndarray | None = None

    def level(self, rgb: np.ndarray, stamp_ns: int) -> np.ndarray:
        """The picture at the reference's exposure, uint8 (H, W, 3); the same array while there is no step."""
        small = rgb[::_COMPARED, ::_COMPARED].transpose(2, 0, 1).copy()
        interval, self._stamp_ns = (stamp_ns - self._stamp_ns) * 1e-9, stamp_ns
        last, self._last = self._last, small
        if last is None or last.shape != small.shape or not 0.0 < interval <= _LONGEST_GAP:
            self.gain = 1.0
            return rgb
        ratio = brightness_ratio(last, small)
        if abs(ratio - 1.0) > _STEP:
            self.gain *= ratio
        self.gain **= math.exp(-interval / _FADE_S)
        return rgb if abs(self.gain - 1.0) <= _STEP else cv2.convertScaleAbs(rgb, alpha=1.0 / self.gain)


def brightness_ratio(before: np.ndarray, after: np.ndarray) -> float:
    """Median ratio of the pixels' brightness of two pictures, uint8 (3, h, w); 1 where nearly all are saturated."""
    usable = np.maximum(before.max(axis=0), after.max(axis=0)) < _UNSATURATED
    ratios = ((after.sum(axis=0) + 1.0) / (before.sum(axis=0) + 1.0))[usable]
    return middle(ratios) if len(ratios) >= _LEAST * usable.size else 1.0


def half_resolution(rgb: np.ndarray) -> tuple[np.ndarray, int]:
    """Picture at half resolution (a small one as it is), uint8 (h, w, 3), and the factor back to its pixels."""
    height, width = rgb.shape[:2]
    if max(height, width) < _SMALL * REFERENCE_WIDTH:
        return rgb, 1
    even = rgb[: height // 2 * 2, : width // 2 * 2]  # the factor must be exact
    return cv2.resize(even, (width // 2, height // 2), interpolation=cv2.INTER_AREA), 2
