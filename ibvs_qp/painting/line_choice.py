"""Which line is which: guides, start mark and stop edge among the tracked lines.

A line is chosen by association: distance to where it must be, the side on which the surface lies, and the direction of
travel; never by "topmost" or "first vertical". All offsets are in metres around the tip's wall point (`TrackedLine`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable

from ibvs_qp.estimation.wall_motion import TrackedLine
from ibvs_qp.measurement import HORIZONTAL, VERTICAL

#: A guide may differ from where it must be by this much [m]: at the start, and from row to row.
START_GATE, ROW_GATE = 0.15, 0.018
#: A fresh edge may lean by this much against the board's [rad]. It is seen 0.05 to 0.25 m ahead of the tip and followed
#: as a straight line: at 3 degrees that of a bent stroke says 8 mm too much or too little. Its short end, too, leans as
#: a row ends; a gate of 6 degrees let it roll the vehicle (the analytic law by 0.30 degrees rms instead of 0.16).
FRESH_LEAN = math.radians(3.0)
#: A line of less weight is lost.
LOST_WEIGHT = 0.05
#: A gate says nothing of a line known less well than this share of it.
GATE_SHARE = 1.0 / 3.0
#: The right board edge is trusted as start mark only this near to its expected place [m].
MARK_GATE = 0.06
#: The edge that ends a row may differ from where it is expected by this much [m]: in row 1, whose length is nominal,
#: and later, when the odometer has passed both ends.
FIRST_STOP_GATE, STOP_GATE = 0.25, 0.06
#: Weight of a line that may become the start mark, and of one that may end a row.
MARK_WEIGHT, STOP_WEIGHT = 0.3, 0.9

Lines = Iterable[TrackedLine]


def bottom_edge(lines: Lines, expected: float, gate: float) -> TrackedLine | None:
    """The level edge of the board below the tip, with the surface above it.

    Args:
        lines: Tracked lines.
        expected: Offset at which it must be [m].
        gate: Farthest that it may be from there [m].
    """

    def accept(line: TrackedLine) -> bool:
        return line.role == HORIZONTAL and line.kind != "paint" and line.surface_side <= 0

    return _nearest(lines, accept, expected, gate)


def fresh_edge(lines: Lines, expected: float, level: float) -> TrackedLine | None:
    """The upper edge of the last row: paint below, bare surface above.

    Args:
        lines: Tracked lines.
        expected: Offset at which it must be [m].
        level: Angle of the rows [rad], see `TrackedLine.angle`.
    """

    def accept(line: TrackedLine) -> bool:
        fresh = line.role == HORIZONTAL and line.kind != "board" and line.surface_side <= 0
        return fresh and abs(line.angle - level) < FRESH_LEAN

    return _nearest(lines, accept, expected, ROW_GATE)


def start_mark(lines: Lines, expected: float) -> TrackedLine | None:
    """The right edge of the board, where a row that starts one margin inside has it; arguments as for `bottom_edge`."""

    def accept(line: TrackedLine) -> bool:
        upright = line.role == VERTICAL and line.kind != "paint"
        return upright and line.surface_side <= 0 and line.weight > MARK_WEIGHT

    return _nearest(lines, accept, expected, MARK_GATE)


def stop_edge(lines: Lines, travel: float, expected: float, gate: float) -> TrackedLine | None:
    """The upright edge ahead whose surface lies on the side that the brush comes from.

    Args:
        lines: Tracked lines.
        travel: Direction of the row, +1 right, -1 left.
        expected: Offset at which it must be [m].
        gate: Farthest that it may be from there [m].
    """
    side = 1 if travel < 0 else -1

    def accept(line: TrackedLine) -> bool:
        upright = line.role == VERTICAL and line.kind != "paint" and line.surface_side == side
        return upright and line.weight > STOP_WEIGHT and travel * line.offset > 0.0

    return _nearest(lines, accept, expected, gate)


def _nearest(lines: Lines, accept: Callable[[TrackedLine], bool], expected: float, gate: float) -> TrackedLine | None:
    best, least = None, gate
    for line in lines:
        if line.weight > 0.0 and line.deviation <= GATE_SHARE * gate:
            away = abs(line.offset - expected)
            if (away < least or (away == least and best is None)) and accept(line):
                best, least = line, away
    return best
