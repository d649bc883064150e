"""Position of board and nominal strokes in the world (truth; no input of the controller).

World NED with the wall to the north: x points into the wall, y to the right as the vehicle sees it, z down. The
board's face is the plane x = 0, its bottom left corner the point y = 0, z = -bottom_m; the wall's face lies at
x = gap_m. Points on the board are given as (along, up) metres from that corner, turned with the board's slope.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sim.world.scene import Scene


@dataclass(frozen=True)
class BoardGeometry:
    """Geometry of board and paint job derived from a scene."""

    scene: Scene

    @cached_property
    def along(self) -> np.ndarray:
        """Unit vector along the bottom edge to the right, in world (y, z), (2,)."""
        slope = math.radians(self.scene.board.slope_deg)
        return np.array([math.cos(slope), math.sin(slope)])

    @cached_property
    def up(self) -> np.ndarray:
        """Unit vector up along the left edge, in world (y, z), (2,)."""
        slope = math.radians(self.scene.board.slope_deg)
        return np.array([math.sin(slope), -math.cos(slope)])

    def point(self, along_m: float | np.ndarray, up_m: float | np.ndarray) -> np.ndarray:
        """World (y, z) of board coordinates [m], (..., 2)."""
        along_m, up_m = np.asarray(along_m, float), np.asarray(up_m, float)
        return self._corner + along_m[..., None] * self.along + up_m[..., None] * self.up

    def board_coordinates(self, yz: np.ndarray) -> np.ndarray:
        """Inverse of `point`: (along, up) [m] of world (y, z), (..., 2)."""
        return (np.asarray(yz, float) - self._corner) @ self._axes

    def spot(self, y: float, z: float) -> tuple[float, float]:
        """`board_coordinates` of one point in plain numbers, fast enough for every tick."""
        (corner_y, corner_z), (right_y, right_z), (up_y, up_z) = self._numbers
        y, z = y - corner_y, z - corner_z
        return y * right_y + z * right_z, y * up_y + z * up_z

    @cached_property
    def _numbers(self) -> tuple[list[float], list[float], list[float]]:
        return self._corner.tolist(), self.along.tolist(), self.up.tolist()

    @cached_property
    def _corner(self) -> np.ndarray:
        """World (y, z) of the bottom left corner [m], (2,)."""
        return np.array([0.0, -self.scene.board.bottom_m])

    @cached_property
    def _axes(self) -> np.ndarray:
        """Columns along and up, (2, 2)."""
        return np.column_stack((self.along, self.up))

    @property
    def row_ends(self) -> tuple[float, float]:
        """Left and right end of every row, along the board [m]."""
        paint = self.scene.paint
        return paint.edge_margin_m, paint.edge_margin_m + paint.stroke_m

    def row_height(self, row: int) -> float:
        """Nominal height of row 1, 2, ... above the bottom edge [m]."""
        return self.scene.paint.edge_margin_m + (row - 1) * self.scene.paint.pitch_m

    @property
    def start_tip(self) -> np.ndarray:
        """World position of the tip at the start of a flight without seed variation [m], (3,)."""
        start, (_, right) = self.scene.start, self.row_ends
        y, z = self.point(right, self.row_height(1))
        return np.array([-start.distance_m, y + start.right_m, z + start.down_m])
