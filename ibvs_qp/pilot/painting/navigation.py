"""Where the tip is in the pattern, where it should be now, and the command that leads it there.

Everything is in pattern coordinates (u along the strokes, v across; `ibvs_qp.pilot.painting.pattern`). Place of the
tip: `cross_track` and `along_track`.
"""

from __future__ import annotations

import math

import numpy as np

from ibvs_qp.pilot.painting.along_track import AlongTrack
from ibvs_qp.pilot.painting.command import ZERO, ExpectedEdge, PainterInput, PaintingCommand
from ibvs_qp.pilot.painting.config import PaintingConfig
from ibvs_qp.pilot.painting.cross_track import LOOK_S, CrossTrack
from ibvs_qp.pilot.painting.pattern import ROWS, Pattern, turned
from ibvs_qp.pilot.painting.pattern_lines import (
    CERTAIN_WEIGHT,
    LOST_WEIGHT,
    PatternLine,
    nearest,
    pattern_line,
    pattern_lines,
    surface_edges,
)
from ibvs_qp.pilot.painting.speed import approached, clipped
from ibvs_qp.pilot.painting.stroke import Stroke

#: An odometer that moves by more at once was corrected after a hole in the data, by the velocity at its end [m/s, m].
MOST_SPEED_M_S, JUMP_M = 1.0, 0.005
#: Lead of the reference along the strokes over a tip off the wall [m]: an edge that comes into view is followed with
#: all of it at once. The way of 0.3 s at 0.18 m/s, and four deviations of the odometer after 0.5 m.
MOST_LEAD_M = 0.07
#: Phases in which all lines in view count at every tick, and phases on the way to the wall and there.
_ALL_LINES, _AT_THE_WALL = ("start", "survey"), ("approach", "align", "press", "paint", "retouch", "climb")


class Navigation:
    """Both coordinates of the tip by odometer and lines, and their references.

    Attributes:
        config: The paint job.
        cross, along: Estimates of v and u.
        lines: Lines in view at the last look, or at this tick where all lines count.
        guide, mark: Lines along and across the strokes that lead the tip at this tick, None where none is in view.
        u_reference, v_reference: Where the tip should be now [m].
    """

    def __init__(self, config: PaintingConfig) -> None:
        self.config, self.pattern = config, Pattern(config.pattern, config.start)
        self.cross, self.along = CrossTrack(config), AlongTrack(config)
        self.lines: list[PatternLine] = []
        self.guide: PatternLine | None = None
        self.mark: PatternLine | None = None
        self.u_reference = self.v_reference = 0.0
        self._odometer: tuple[float, float] | None = None
        self._looked = -math.inf

    def update(self, inputs: PainterInput, dt: float, phase: str, stroke: Stroke) -> list[tuple[float, str, str]]:
        """Move both coordinates by the odometer and correct them with the lines in view; returns entries of the log."""
        cross, along, pattern, now = self.cross, self.along, self.pattern, inputs.time_s
        odometer = float(inputs.odometer[0]), float(inputs.odometer[1])
        last, self._odometer = self._odometer or odometer, odometer
        moved = pattern.to_pattern(odometer[0] - last[0], odometer[1] - last[1])
        du, dv = turned(*moved, -cross.filter.turn)
        jumped = math.hypot(du, dv) > MOST_SPEED_M_S * dt + JUMP_M
        cross.predict(du, dv, dt, jumped)
        along.predict(du, jumped)
        if inputs.in_contact and phase in ("paint", "retouch"):
            cross.lay(along.u)
        turn, events = cross.picture_turn, []
        looks = now - self._looked >= LOOK_S and phase != "start"
        if looks or phase in _ALL_LINES:
            self.lines = pattern_lines(inputs.lines.values(), pattern, turn)
        if looks:
            self._looked = now
            cross.look(self.lines, along.u, stroke.direction, phase == "retouch")
            if along.known and (noticed := along.look(self.lines)):
                events.append((now, "edge", noticed))
        before = self.guide
        self.guide = self._first_in_view(inputs, self._guides(phase, stroke.place), turn)
        self.mark = self._first_in_view(inputs, self._marks(phase, stroke), turn)
        if self.guide is not None and phase != "start":
            line = self.guide.track
            if before is None or before.track.track_id != line.track_id:
                events.append((now, "guide", f"track {line.track_id} at {line.offset * 1e3:+.1f} mm"))
        return events

    def _first_in_view(self, inputs: PainterInput, tracks: list[int], turn: float) -> PatternLine | None:
        for track in tracks:
            line = inputs.lines.get(track)
            if line is not None and line.weight > LOST_WEIGHT:
                if (found := pattern_line(line, self.pattern, turn)) is not None:
                    return found
        return None

    def _guides(self, phase: str, place: float) -> list[int]:
        """Tracks of the edges along the strokes, best first; on the way to the wall and there, those that stay in view.

        Another one would hold the vehicle back: the view barrier keeps it in the picture.
        """
        reach = self.config.guide_reach_m if phase in _AT_THE_WALL else math.inf
        return [track for track, v in self.cross.guides.items() if abs(v - place) < reach]

    def _marks(self, phase: str, stroke: Stroke) -> list[int]:
        """Tracks of the edge next to the place to which the tip moves; another one may leave the picture on the way."""
        if phase == "survey":
            return []
        to_end = (stroke.travel > 0.0) == (phase in ("paint", "retouch"))
        return [self.along.end if to_end else self.along.near]

    def starting_guide(self) -> PatternLine | None:
        """The board's edge at which the pattern starts, with the surface on its inner side, where it is certain."""
        gates, edges = self.config.gates, surface_edges(self.lines, parallel=True)
        guide = nearest(edges, -self.config.edge_margin_m, gates.start_m)
        if guide is None or guide.weight <= CERTAIN_WEIGHT or guide.track.deviation >= gates.start_deviation_m:
            return None
        return guide

    def expected_edge(self, outwards: float, ahead: float) -> ExpectedEdge:
        """An outer edge of paint that far from the tip across the strokes [m], in view in that direction along u."""
        pattern, (at, other) = self.pattern, (1, 0) if self.pattern.kind == ROWS else (0, 1)
        sign, place = pattern.across[at], outwards - self.cross.tip_error
        return ExpectedEdge(pattern.guide_role, place * sign, int(sign), int(ahead * pattern.along[other]))

    def hold(self) -> None:
        """Where the tip is, is where it should be."""
        self.u_reference, self.v_reference = self.along.u, self.cross.v

    def move_to(self, u: float, v: float, dt: float) -> tuple[float, float]:
        """Move both references towards a place off the wall; returns their speeds [m/s]."""
        last = self.u_reference, self.v_reference
        planned = approached(last[0], u, self.config.survey_speed_m_s * dt)
        self.u_reference = clipped(planned, self.along.u - MOST_LEAD_M, self.along.u + MOST_LEAD_M)
        self.v_reference = approached(last[1], v, self.config.climb_speed_m_s * dt)
        if dt <= 0.0:
            return 0.0, 0.0
        return (planned - last[0]) / dt, (self.v_reference - last[1]) / dt

    def slide_to(self, v: float, dt: float) -> None:
        """Move the reference across the strokes on the wall."""
        self.v_reference = approached(self.v_reference, v, self.config.guide_slide_m_s * dt)

    def command(
        self,
        *,
        contact: bool,
        standoff: float = 0.0,
        guided: bool = True,
        hold: bool = False,
        edge: bool = False,
        speed: tuple[float, float] = (0.0, 0.0),
        travel: float = 0.0,
    ) -> PaintingCommand:
        """Command of the tick; without a line in view, the odometer holds.

        ``guided`` holds v at its reference, ``hold`` u, ``edge`` u where the edge beside it is in view. ``speed`` is
        that along u and v, ``travel`` that along u which is planned at this push [m/s].
        """
        guides, (u, v) = [], speed
        if guided:
            error = self.v_reference - self.cross.v
            if self.guide is not None:
                guides.append((self.guide.track, self.guide.target(error)))
            else:
                v += self._held(error)
        if hold or edge:
            error = self.u_reference - self.along.u
            if self.mark is not None:
                guides.append((self.mark.track, self.mark.target(error)))
            elif hold:
                u += self._held(error)
        velocity = np.array(self.pattern.to_wall(*turned(u, v, self.cross.filter.turn)))
        planned = np.array(self.pattern.to_wall(travel, 0.0)) if travel else ZERO
        return PaintingCommand(contact, standoff, velocity, guides, self.config.push_n, ZERO, planned)

    def _held(self, error: float) -> float:
        """Speed that holds a place by the odometer [m/s]."""
        config = self.config
        return clipped(config.hold_gain * error, -config.hold_speed_m_s, config.hold_speed_m_s)
