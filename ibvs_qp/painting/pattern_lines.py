"""The tracked lines in pattern coordinates around the tip."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from ibvs_qp.estimation.tracked_line import TrackedLine
from ibvs_qp.painting.pattern import Pattern

#: A line this far from its nominal direction belongs to neither family: component of its normal [-], 45 deg.
_LEAST_COMPONENT = 0.7
#: Weight of a line [0..1]: below, it is lost; above, it may mark the start; it is in view; it may end a stroke or lead.
LOST_WEIGHT, MARK_WEIGHT, VISIBLE_WEIGHT, CERTAIN_WEIGHT = 0.05, 0.3, 0.5, 0.9


@dataclass(slots=True)
class PatternLine:
    """A tracked line in the axes of a pattern (u along the strokes, v across).

    Attributes:
        track: The line.
        parallel: Whether it runs along the strokes.
        place: Its v minus the tip's, where it runs along the strokes; its u minus the tip's otherwise [m].
        lean: Change of that coordinate per metre of the other one [-].
        side: Where the surface lies, for paint the bare one: +1 at larger coordinates, -1 at smaller ones, 0 unknown.
        scale: Offset of the line along its own normal per metre of place [-].
        middle: Middle of the piece that the last frame shows, (u, v) from the tip [m]; NaN where unknown.
        length: Length of that piece [m].
    """

    track: TrackedLine
    parallel: bool
    place: float
    lean: float
    side: int
    scale: float
    middle: tuple[float, float]
    length: float

    @property
    def weight(self) -> float:
        """Weight of the line now, 0 to 1."""
        return self.track.weight

    @property
    def kind(self) -> str:
        """What it borders: "board", "paint" or ""."""
        return self.track.kind


def pattern_lines(lines: Iterable[TrackedLine], pattern: Pattern, turn: float) -> list[PatternLine]:
    """The lines that have a weight, in the axes of a pattern that is turned by a small angle from u to v [rad]."""
    c, s = math.cos(turn), math.sin(turn)
    found = []
    for line in lines:
        if line.weight <= 0.0:
            continue
        normal = pattern.to_pattern(math.cos(line.angle), math.sin(line.angle))
        along, across = _turned(*normal, c, s)
        parallel = line.role == pattern.guide_role
        scale, other = (across, along) if parallel else (along, across)
        if abs(scale) < _LEAST_COMPONENT:
            continue
        side = line.surface_side if scale > 0.0 else -line.surface_side
        middle = _turned(*pattern.to_pattern(*_middle(line)), c, s)
        place = line.offset / scale
        found.append(PatternLine(line, parallel, place, -other / scale, side, scale, middle, line.length))
    return found


def _middle(line: TrackedLine) -> tuple[float, float]:
    """Middle of the visible piece, (right, down) from the tip [m]."""
    c, s, offset = math.cos(line.seen_angle), math.sin(line.seen_angle), line.seen_offset
    return offset * c - line.middle * s, offset * s + line.middle * c


def _turned(u: float, v: float, c: float, s: float) -> tuple[float, float]:
    return c * u + s * v, c * v - s * u
