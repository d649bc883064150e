"""The tracked lines in pattern coordinates around the tip."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from ibvs_qp.estimation.tracked_line import TrackedLine
from ibvs_qp.pilot.painting.pattern import Pattern, turned

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
        length: Length of the piece that the last frame shows [m].
        middle: Middle of that piece, (u, v) from the tip [m]; NaN where unknown, and in a single `pattern_line`.
    """

    track: TrackedLine
    parallel: bool
    place: float
    lean: float
    side: int
    scale: float
    length: float
    middle: tuple[float, float] = (math.nan, math.nan)

    @property
    def weight(self) -> float:
        """Weight of the line now, 0 to 1."""
        return self.track.weight

    @property
    def kind(self) -> str:
        """Object that it borders: "board", "paint" or ""."""
        return self.track.kind

    def target(self, error: float) -> float:
        """Target offset of the line [m] where the tip's coordinate is to grow by an error [m].

        The controller moves the tip by lines. The target is where the line appears once the error is gone, so that the
        controller acts on the estimate: a painted edge may wave, and a change of line makes no step.
        """
        return (self.place - error) * self.scale


def pattern_line(line: TrackedLine, pattern: Pattern, turn: float) -> PatternLine | None:
    """The line in the axes of a pattern that is turned by a small angle from u to v [rad]; None if it is diagonal."""
    along, across = turned(*pattern.to_pattern(math.cos(line.angle), math.sin(line.angle)), -turn)
    parallel = line.role == pattern.guide_role
    scale, other = (across, along) if parallel else (along, across)
    if abs(scale) < _LEAST_COMPONENT:
        return None
    side = line.surface_side if scale > 0.0 else -line.surface_side
    return PatternLine(line, parallel, line.offset / scale, -other / scale, side, scale, line.length)


def pattern_lines(lines: Iterable[TrackedLine], pattern: Pattern, turn: float) -> list[PatternLine]:
    """Those lines that have a weight and a direction of the pattern, as of `pattern_line`."""
    found = []
    for track in lines:
        if track.weight > 0.0 and (line := pattern_line(track, pattern, turn)) is not None:
            c, s, offset = math.cos(track.seen_angle), math.sin(track.seen_angle), track.seen_offset
            middle = pattern.to_pattern(offset * c - track.middle * s, offset * s + track.middle * c)
            line.middle = turned(*middle, -turn)
            found.append(line)
    return found


def surface_edges(lines: Iterable[PatternLine], parallel: bool, side: int = 1) -> list[PatternLine]:
    """Edges along or across the strokes, not of paint; the surface at larger coordinates or unknown, or at smaller."""
    edges = [line for line in lines if line.parallel == parallel and line.kind != "paint"]
    return [line for line in edges if (line.side < 0) == (side < 0)]


def nearest(lines: Iterable[PatternLine], place: float, gate: float = math.inf) -> PatternLine | None:
    """The line nearest to a place, within a gate [m]; None without one."""
    near = [line for line in lines if abs(line.place - place) < gate]
    return min(near, key=lambda line: abs(line.place - place), default=None)
