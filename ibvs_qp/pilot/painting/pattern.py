"""Pattern of a paint job: rows or columns, and the corner of the board at which stroke 1 begins.

Pattern coordinates (u, v) [m] lie in the wall plane: u points along stroke 1, v from stroke to stroke. Odd strokes
travel along +u, even ones along -u. On a board, u counts from the edge at which stroke 1 begins and v from the edge
that guides stroke 1. In the wall plane every vector is (right, down).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

from ibvs_qp.measurement import HORIZONTAL, VERTICAL

ROWS, COLUMNS = "rows", "columns"
PATTERNS = (ROWS, COLUMNS)
CORNERS = ("bottom-right", "bottom-left", "top-right", "top-left")
#: As many strokes as the board has place for.
FILL = "fill"
#: Farthest that a stroke at its place may lie from its nominal place, in the mean over its straight part [m].
PLACE_TOLERANCE_M = 0.008
#: A rest of the board that is narrower than this gets no stroke of its own [m].
FILL_REST_M = PLACE_TOLERANCE_M

Axis = tuple[float, float]


@dataclass(frozen=True)
class Pattern:
    """Directions of the strokes.

    Attributes:
        kind: "rows" or "columns".
        start: Corner at which stroke 1 begins, as "bottom-right".
    """

    kind: str = ROWS
    start: str = CORNERS[0]

    @cached_property
    def along(self) -> Axis:
        """Unit vector of u: the travel of stroke 1, (right, down)."""
        return self._axes[0] if self.kind == ROWS else self._axes[1]

    @cached_property
    def across(self) -> Axis:
        """Unit vector of v: from stroke to stroke, (right, down)."""
        return self._axes[1] if self.kind == ROWS else self._axes[0]

    @property
    def guide_role(self) -> str:
        """Role of the lines parallel to the strokes."""
        return HORIZONTAL if self.kind == ROWS else VERTICAL

    @property
    def inwards(self) -> tuple[int, int]:
        """Where the board lies from its start corner, (right, down), +1 or -1 each."""
        return -1 if self.start.endswith("right") else 1, -1 if self.start.startswith("bottom") else 1

    @staticmethod
    def travel(stroke: int) -> float:
        """Direction of a stroke along u: +1 for odd ones, -1 for even ones."""
        return 1.0 if stroke % 2 == 1 else -1.0

    def to_pattern(self, right: float, down: float) -> tuple[float, float]:
        """(u, v) of a vector in the wall plane."""
        along, across = self.along, self.across
        return along[0] * right + along[1] * down, across[0] * right + across[1] * down

    def to_wall(self, u: float, v: float) -> tuple[float, float]:
        """(right, down) of a vector in pattern coordinates."""
        along, across = self.along, self.across
        return along[0] * u + across[0] * v, along[1] * u + across[1] * v

    @property
    def _axes(self) -> tuple[Axis, Axis]:
        """From the start corner into the board: sideways, and up or down."""
        right, down = self.inwards
        return (float(right), 0.0), (0.0, float(down))


def turned(u: float, v: float, angle: float) -> tuple[float, float]:
    """(u, v) of a vector that is turned from u to v by an angle [rad]."""
    c, s = math.cos(angle), math.sin(angle)
    return c * u - s * v, s * u + c * v


def stroke_count(rows: int | str, extent_m: float, edge_margin_m: float, pitch_m: float) -> int:
    """Number of strokes on a board.

    Args:
        rows: The job's number of strokes, or "fill".
        extent_m: Size of the board across the strokes [m].
        edge_margin_m: Centre of the first and of a filling job's last stroke to the board's edge [m].
        pitch_m: Distance between strokes [m].
    """
    if isinstance(rows, int):
        return rows
    rest = extent_m - 2.0 * edge_margin_m - FILL_REST_M
    return 1 + max(math.ceil(rest / pitch_m), 0)


def stroke_place(stroke: int, rows: int | str, extent_m: float, edge_margin_m: float, pitch_m: float) -> float:
    """Nominal v of the centre of a stroke [m], see `stroke_count`; a filling job's last one keeps the margin."""
    place = edge_margin_m + (stroke - 1) * pitch_m
    if isinstance(rows, int) or stroke < stroke_count(rows, extent_m, edge_margin_m, pitch_m):
        return place
    return max(extent_m - edge_margin_m, edge_margin_m)
