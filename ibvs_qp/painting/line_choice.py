"""Choice of guide, start mark and stop edge among the tracked lines.

A line is chosen by its distance from the expected place, the side on which the surface lies, and the direction of
travel; never as "topmost" or "first upright". Offsets are in metres from the tip's wall point (`TrackedLine`);
``expected`` is the expected offset and ``gate`` the largest distance from it [m].
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable

from ibvs_qp.estimation.wall_motion import TrackedLine
from ibvs_qp.measurement import HORIZONTAL, VERTICAL
from ibvs_qp.painting.config import LineGates

#: Weight of a line [0..1]: below, it is lost; above, it may mark the start; it is in view; it may end a row or lead.
LOST_WEIGHT, MARK_WEIGHT, VISIBLE_WEIGHT, CERTAIN_WEIGHT = 0.05, 0.3, 0.5, 0.9
#: Largest standard deviation of an offset relative to the gate: three of them fit into it.
DEVIATION_RATIO = 1.0 / 3.0

Lines = Iterable[TrackedLine]


def bottom_edge(lines: Lines, expected: float, gate: float) -> TrackedLine | None:
    """The level edge of the board below the tip, with the surface above it."""

    def accept(line: TrackedLine) -> bool:
        return line.role == HORIZONTAL and line.kind != "paint" and line.surface_side <= 0

    return _nearest(lines, accept, expected, gate)


def fresh_edge(lines: Lines, expected: float, level: float, gates: LineGates) -> TrackedLine | None:
    """The upper edge of the last row: paint below, bare surface above; ``level`` is the angle of the rows [rad]."""

    def accept(line: TrackedLine) -> bool:
        fresh = line.role == HORIZONTAL and line.kind != "board" and line.surface_side <= 0
        return fresh and abs(line.angle - level) < math.radians(gates.fresh_lean_deg)

    return _nearest(lines, accept, expected, gates.row_m)


def start_mark(lines: Lines, expected: float, gate: float) -> TrackedLine | None:
    """The right edge of the board beside the start of row 1."""

    def accept(line: TrackedLine) -> bool:
        upright = line.role == VERTICAL and line.kind != "paint"
        return upright and line.surface_side <= 0 and line.weight > MARK_WEIGHT

    return _nearest(lines, accept, expected, gate)


def stop_edge(lines: Lines, travel: float, expected: float, gate: float) -> TrackedLine | None:
    """The upright edge ahead, its surface on the side from which the brush comes; ``travel`` is +1 right, -1 left."""
    side = 1 if travel < 0 else -1

    def accept(line: TrackedLine) -> bool:
        upright = line.role == VERTICAL and line.kind != "paint" and line.surface_side == side
        return upright and line.weight > CERTAIN_WEIGHT and travel * line.offset > 0.0

    return _nearest(lines, accept, expected, gate)


def _nearest(lines: Lines, accept: Callable[[TrackedLine], bool], expected: float, gate: float) -> TrackedLine | None:
    best, least = None, gate
    for line in lines:
        if line.weight > 0.0 and line.deviation <= DEVIATION_RATIO * gate:
            away = abs(line.offset - expected)
            if (away < least or (away == least and best is None)) and accept(line):
                best, least = line, away
    return best
