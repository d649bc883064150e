"""View of the lines of a paint job while the brush presses: geometry of a level vehicle at its place.

A line is in view where it lies within the bounds that the controller keeps guides in (`LimitSettings.view_left` and so
on, from the camera of the vehicle), and outside the brush.
"""

from __future__ import annotations

import numpy as np

from ibvs_qp.frames import to_camera
from ibvs_qp.pilot import PilotConfig
from ibvs_qp.pilot.painting.pattern import Pattern

#: Spacing of the points at which a line is tested [m]: a pixel is 0.8 mm at 640x480 and 0.5 m.
STEP_M = 0.001


class ContactView:
    """The picture of the wall plane around the tip, in pattern coordinates relative to it.

    Args:
        pattern: Directions of the strokes.
        config: The nominal vehicle of the controller, its bounds of the view, and the shortest line.
        brush_width_m: Diameter of the brush, which hides the wall [m].
    """

    def __init__(self, pattern: Pattern, config: PilotConfig, brush_width_m: float) -> None:
        vehicle, limits = config.controller.vehicle, config.controller.limits
        tip = to_camera(np.array(vehicle.tip_position_m), np.array(vehicle.camera_position_m))
        depth = max(float(tip[2]), 0.0)
        bounds = np.array(((limits.view_left, limits.view_up), (limits.view_right, limits.view_down)))
        self._low, self._high = bounds * depth - tip[:2]
        self._axes, self._radius = np.array((pattern.along, pattern.across)), 0.5 * brush_width_m
        width = vehicle.camera_size_px[0] / vehicle.camera_intrinsics_px[0]
        self._least = config.vision.detect.min_length * width * depth
        self._reach = 2.0 * float(np.abs(bounds).max()) * depth

    def shows_parallel(self, aside: float, behind: float, ahead: float) -> bool:
        """Whether a line along the strokes has a piece in view that is long enough to be found.

        Args:
            aside: Its v relative to the tip's [m].
            behind: Its least u relative to the tip's [m].
            ahead: Its greatest u [m].
        """
        along = self._between(behind, ahead)
        return self._longest(np.column_stack((along, np.full(len(along), aside)))) >= self._least

    def shows_across(self, ahead: float, low: float, high: float) -> bool:
        """The same of a line across the strokes.

        Args:
            ahead: Its u relative to the tip's [m].
            low: Its least v relative to the tip's [m].
            high: Its greatest v [m].
        """
        across = self._between(low, high)
        return self._longest(np.column_stack((np.full(len(across), ahead), across))) >= self._least

    def _between(self, low: float, high: float) -> np.ndarray:
        return np.arange(max(low, -self._reach), min(high, self._reach), STEP_M)

    def _longest(self, uv: np.ndarray) -> float:
        """Length of the longest run of points in view [m]."""
        places = uv @ self._axes  # (right, down)
        inside = ((places >= self._low) & (places <= self._high)).all(axis=1)
        seen = np.concatenate(([0], (inside & (np.hypot(*uv.T) > self._radius)).astype(int), [0]))
        edges = np.flatnonzero(np.diff(seen))
        return STEP_M * float(max((edges[1::2] - edges[::2]), default=0))
