"""One picture for all stages: exposure levelled, with mask, samples, camera and gravity."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property

import cv2
import numpy as np

from ibvs_qp.measurement import RgbdFrame
from ibvs_qp.vision.compilation import middle
from ibvs_qp.vision.config import REFERENCE_WIDTH
from ibvs_qp.vision.picture.layout import Intrinsics, PictureLayout

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


class Picture:
    """A frame at its places: everything that the stages read of it.

    Attributes:
        rgb, depth: The frame itself, uint8 (H, W, 3) and float32 (H, W) [m].
        mask: Non-zero where the vehicle hides the view, uint8 (H, W).
        intrinsics: (fx, fy, cx, cy) [px].
        scale: Factor for settings in pixels of a 640 wide picture.
        layout, grid: Masks and grids, and the coarse grid of them.
        down: Gravity's direction in C, unit, (3,), or None if unknown.
        tilt: Angle of gravity in the picture from down [rad], or None if unknown.
        plane: (a, b, c) of the surface, or None before it is known.
    """

    def __init__(self, frame: RgbdFrame, layout: PictureLayout, down: np.ndarray | None = None) -> None:
        fx, fy, cx, cy = frame.intrinsics
        self.rgb, self.depth, self.intrinsics = frame.rgb, frame.depth, (float(fx), float(fy), float(cx), float(cy))
        self.layout, self.grid, self.mask, self.down = layout, layout.grid, layout.mask, down
        self.tilt = None if down is None else float(np.arctan2(-down[0], down[1]))
        self.scale = max(self.mask.shape) / REFERENCE_WIDTH
        self.plane: tuple[float, float, float] | None = None

    @cached_property
    def colors(self) -> np.ndarray:
        """Colours at the samples of the grid, uint8 (rows, columns, 3)."""
        return self.grid.sample(self.rgb)

    @cached_property
    def inverse(self) -> np.ndarray:
        """1/Z at the samples [1/m], 0 where absent or out of range, (rows, columns)."""
        return self.grid.inverse_depth(self.depth)


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


def camera_matrix(intrinsics: Sequence[float]) -> np.ndarray:
    """OpenCV's camera matrix of (fx, fy, cx, cy) [px], (3, 3)."""
    fx, fy, cx, cy = intrinsics
    return np.array(((fx, 0.0, cx), (0.0, fy, cy), (0.0, 0.0, 1.0)))


def normalise(pixels: np.ndarray, intrinsics: Intrinsics) -> np.ndarray:
    """Normalised coordinates of pixels (..., 2)."""
    return (pixels - np.array(intrinsics[2:])) / np.array(intrinsics[:2])


def denormalise(points: np.ndarray, intrinsics: Intrinsics) -> np.ndarray:
    """Pixels of normalised coordinates (..., 2)."""
    return points * np.array(intrinsics[:2]) + np.array(intrinsics[2:])
