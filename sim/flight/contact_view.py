"""What the camera sees of the lines of a paint job while the brush presses: geometry of a level vehicle at its place.

A line is in view where it lies inside the picture, less what the allowed tilt moves it, and outside the brush.
"""

from __future__ import annotations

import math

import numpy as np

from ibvs_qp.pilot import PilotConfig
from sim.sensors.cameras.arm import camera_axes
from sim.world.board import BoardGeometry

#: Spacing of the points at which a line is tested [m]: a pixel is 0.8 mm at 640x480 and 0.5 m.
STEP_M = 0.001


class ContactView:
    """The picture of the wall plane around the tip, in pattern coordinates relative to it.

    Args:
        board: Board, paint job and camera.
        config: The vehicle as the controller believes it, the allowed tilt and the shortest line.
        brush_width_m: Diameter of the brush, which hides the wall [m].
    """

    def __init__(self, board: BoardGeometry, config: PilotConfig, brush_width_m: float) -> None:
        camera, vehicle = board.scene.camera, config.controller.vehicle
        down = math.tan(0.5 * math.radians(camera.vertical_fov_deg))
        tilt = math.tan(math.radians(config.controller.limits.tilt_deg))
        half = np.array((down * camera.width / camera.height, down))
        self._half = half - tilt
        self._axes, self._tip = camera_axes(vehicle), np.array(vehicle.tip_position_m) - vehicle.camera_position_m
        self._pattern, self._radius = board.pattern, 0.5 * brush_width_m
        depth = float((self._axes @ self._tip)[2])
        self._least = 2.0 * config.vision.detect.min_length * float(half[0]) * max(depth, 0.0)
        self._reach = 4.0 * float(np.hypot(*half)) * max(depth, 0.0)

    def shows_parallel(self, aside: float, behind: float, ahead: float) -> bool:
        """Whether a line along the strokes has a piece in view that is long enough to be found.

        Args:
            aside: Its v relative to the tip's [m].
            behind: Its least u relative to the tip's [m].
            ahead: Its greatest u [m].
        """
        along = np.arange(max(behind, -self._reach), min(ahead, self._reach), STEP_M)
        return self._longest(np.column_stack((along, np.full(len(along), aside)))) >= self._least

    def _longest(self, uv: np.ndarray) -> float:
        """Length of the longest run of points in view [m]."""
        (right_u, down_u), (right_v, down_v) = self._pattern.along, self._pattern.across
        right, down = uv @ (right_u, right_v), uv @ (down_u, down_v)
        points = (self._tip + np.column_stack((np.zeros(len(uv)), right, down))) @ self._axes.T
        deep = np.maximum(points[:, 2], 1e-3)
        inside = (np.abs(points[:, :2] / deep[:, None]) <= self._half).all(axis=1) & (points[:, 2] > 0.0)
        seen = np.concatenate(([0], (inside & (np.hypot(*uv.T) > self._radius)).astype(int), [0]))
        edges = np.flatnonzero(np.diff(seen))
        return STEP_M * float(max((edges[1::2] - edges[::2]), default=0))
