"""Depth of a real stereo camera: quantised disparity, near surfaces that grow, and a shift against the colour."""

from __future__ import annotations

import math

import cv2
import numpy as np

from sim.sensors.cameras.warp import PictureWarp, nearest_remap
from sim.world.errors import DepthErrors

#: Relative step of depth at which the nearer surface grows; ten pixels of a plane turned by 30 degrees change by 0.9 %.
_STEP_RELATIVE = 0.01


class DepthDefects:
    """Errors of the depth; the white noise is part of the noise bank.

    Depth has a global shutter and no motion blur, as in the RealSense D435.

    Args:
        errors: Their sizes; the growth is rounded to whole pixels.
        focal_px: Focal length.
        warp: Lens distortion.
        rng: Direction of the shift.

    Attributes:
        growth_px: By how much near surfaces grow over far ones.
        shift_px: Of depth against colour, (2,).
    """

    def __init__(self, errors: DepthErrors, focal_px: float, warp: PictureWarp, rng: np.random.Generator) -> None:
        self.growth_px = round(errors.edge_fattening_px)
        angle = rng.uniform(0.0, 2.0 * math.pi)
        self.shift_px = errors.misregistration_px * np.array([math.cos(angle), math.sin(angle)])
        step = errors.disparity_step_px
        self._steps_m = focal_px * errors.baseline_m / step if step else 0.0  # depth times steps of disparity
        self._places = warp.nearest(self.shift_px)

    def grown(self, layer: np.ndarray) -> np.ndarray:
        """A layer whose larger values have grown, (H, W)."""
        side = 2 * self.growth_px + 1
        return cv2.dilate(layer, np.ones((side, side), np.uint8)) if self.growth_px else layer

    def fatten(self, inverse: np.ndarray) -> None:
        """Let near surfaces grow over far ones, as the window of a stereo matcher does, in place.

        Args:
            inverse: Inverse depth without noise [1/m], float32 (H, W).
        """
        if self.growth_px:
            near = self.grown(inverse)
            step = cv2.compare(near, inverse * np.float32(1.0 + _STEP_RELATIVE), cv2.CMP_GT)
            cv2.copyTo(near, step, inverse)

    def measure(self, factor: np.ndarray, inverse: np.ndarray, depth: np.ndarray) -> None:
        """Write ``factor / inverse`` [m] into ``depth``, rounded to whole steps of disparity; all float32 (H, W)."""
        if not self._steps_m:
            cv2.divide(factor, inverse, depth)
            return
        cv2.divide(inverse, factor, depth, scale=self._steps_m)
        np.rint(depth, out=depth)
        np.maximum(depth, np.float32(1.0), out=depth)  # infinity has no disparity
        np.divide(np.float32(self._steps_m), depth, out=depth)

    def placed(self, depth: np.ndarray) -> np.ndarray:
        """Depth where the lens and the shift put it, from the nearest pixel: holes (0) must not mix with readings."""
        return nearest_remap(depth, self._places, cv2.BORDER_CONSTANT)
