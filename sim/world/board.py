"""Position of board and nominal strokes in the world (truth; no input of the controller).

World: x points into the wall along its normal in the middle of the board, y to the right for the vehicle, z down along
the wall. For an upright wall this is NED with the wall to the north; a leaning one turns gravity, and with it NED,
about y. A place on the wall is given by its chart (`sim.world.surfaces`), which for a flat wall is the world itself:
the board's face at x = 0, its bottom left corner at y = 0, z = -bottom_m, the wall's face at x = gap_m. Points on the
board are given as (along, up) metres from that corner, turned with the board's slope.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ibvs_qp.pilot.painting.pattern import ROWS, Pattern, stroke_count, stroke_place
from sim.world.scene import Scene
from sim.world.surfaces import KINDS, Surface


@dataclass(frozen=True)
class BoardGeometry:
    """Geometry of board and paint job derived from a scene."""

    scene: Scene

    @cached_property
    def surface(self) -> Surface:
        """Shape of the wall."""
        board = self.scene.board
        middle = self.point(0.5 * board.width_m, 0.5 * board.height_m)
        return KINDS[self.scene.surface.kind](middle, self.scene.surface)

    @cached_property
    def down(self) -> np.ndarray:
        """Unit vector of gravity in the world, (3,)."""
        lean = math.radians(self.scene.surface.lean_deg)
        return np.array([math.sin(lean), 0.0, math.cos(lean)])

    @cached_property
    def attitude(self) -> np.ndarray:
        """Quaternion (w, x, y, z) of the world in NED, (4,)."""
        half = 0.5 * math.radians(self.scene.surface.lean_deg)
        return np.array([math.cos(half), 0.0, -math.sin(half), 0.0])

    @cached_property
    def from_ned(self) -> np.ndarray:
        """Rotation from NED to the world, (3, 3)."""
        sine, _, cosine = self.down.tolist()
        return np.array([[cosine, 0.0, sine], [0.0, 1.0, 0.0], [-sine, 0.0, cosine]])

    def bearing(self, place: np.ndarray) -> float:
        """Yaw that faces the wall at a place of the chart (3,) [rad], + to the right."""
        north, east, _ = self.from_ned.T @ self.surface.axes(place)[:, 0]
        return math.atan2(east, north)

    @property
    def ground(self) -> float:
        """Height of the ground: the points with ``down @ point`` of this [m]; the corner stays at its height."""
        return self.scene.board.bottom_m * (1.0 - self.down[2])

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

    @cached_property
    def pattern(self) -> Pattern:
        """Directions of the strokes."""
        return Pattern(self.scene.paint.pattern, self.scene.paint.start)

    @cached_property
    def extent(self) -> tuple[float, float]:
        """Size of the board along and across the strokes [m]."""
        size = self.scene.board.width_m, self.scene.board.height_m
        return size if self.pattern.kind == ROWS else (size[1], size[0])

    @property
    def stroke_ends(self) -> tuple[float, float]:
        """Beginning and end of stroke 1, u [m]; all strokes lie between them."""
        end = self.extent[0] - self.scene.paint.edge_margin_m
        return end - self.scene.paint.stroke_m, end

    @property
    def slack_m(self) -> float:
        """Board that remains beside the beginning of stroke 1, beyond the margin [m]."""
        return self.stroke_ends[0] - self.scene.paint.edge_margin_m

    @property
    def strokes(self) -> int:
        """Number of strokes."""
        paint = self.scene.paint
        return stroke_count(paint.rows, self.extent[1], paint.edge_margin_m, paint.pitch_m)

    def stroke_place(self, stroke: int) -> float:
        """Nominal v of the centre of stroke 1, 2, ... [m]."""
        paint = self.scene.paint
        return stroke_place(stroke, paint.rows, self.extent[1], paint.edge_margin_m, paint.pitch_m)

    def to_pattern(self, along_up: np.ndarray) -> np.ndarray:
        """Pattern coordinates (u, v) of board coordinates (along, up) [m], (..., 2)."""
        return (np.asarray(along_up, float) - self._start_corner) @ self._pattern_axes

    def from_pattern(self, uv: np.ndarray) -> np.ndarray:
        """Inverse of `to_pattern`: board coordinates (along, up) [m], (..., 2)."""
        return np.asarray(uv, float) @ self._pattern_axes.T + self._start_corner

    @cached_property
    def _start_corner(self) -> np.ndarray:
        """Corner of the board at which stroke 1 begins, (along, up) [m]."""
        board, start = self.scene.board, self.pattern.start
        return np.array(
            (
                board.width_m if start.endswith("right") else 0.0,
                0.0 if start.startswith("bottom") else board.height_m,
            )
        )

    @cached_property
    def _pattern_axes(self) -> np.ndarray:
        """Columns u and v in (along, up), (2, 2)."""
        return np.column_stack((self.pattern.along, self.pattern.across)) * np.array([[1.0], [-1.0]])

    @property
    def start_tip(self) -> np.ndarray:
        """Chart of the tip at the start of a flight without seed variation [m], (3,)."""
        start = self.scene.start
        y, z = self.point(*self.from_pattern(np.array((self.stroke_ends[0], self.stroke_place(1)))))
        return np.array([-start.distance_m, y + start.right_m, z + start.down_m])
