"""The painting strategy: start, approach, align, press, paint and climb row by row, retreat, done.

Offsets are in metres from the tip's wall point (`TrackedLine`). The guide of a row: `ibvs_qp.painting.guide_line`; the
end of a stroke: `ibvs_qp.painting.stroke_end`; time-outs and failure: `ibvs_qp.painting.phase_machine`.
"""

from __future__ import annotations

import math

import numpy as np

from ibvs_qp.estimation.wall_motion import TrackedLine
from ibvs_qp.measurement import VERTICAL
from ibvs_qp.painting.alignment import Alignment
from ibvs_qp.painting.command import ZERO, PainterInput, PaintingCommand
from ibvs_qp.painting.config import PaintingConfig
from ibvs_qp.painting.guide_line import GuideLine
from ibvs_qp.painting.line_choice import CERTAIN_WEIGHT, VISIBLE_WEIGHT, bottom_edge, start_mark
from ibvs_qp.painting.phase_machine import PhaseMachine
from ibvs_qp.painting.speed import climb_speed, clipped, ramped, stroke_speed
from ibvs_qp.painting.stroke_end import STOP_DISTANCE, StrokeEnd, travel_of

#: Difference from the stand-off and from the retreat distance at which these phases end [m].
STANDOFF_REACHED, RETREAT_REACHED = 0.01, 0.02
#: Least push to which the relative error of a press refers [N].
PRESS_REFERENCE_MIN = 1.0


class Painter(PhaseMachine):
    """Paints the rows of a job; `step` returns the command of the tick.

    Attributes:
        row: Row in progress from 1, 0 before the first stroke.
    """

    _SLIDES = True  # whether a stroke follows the press
    _COMPLETED = "all rows painted, retreated"

    def __init__(self, config: PaintingConfig) -> None:
        self._travel = np.array((-config.speed_m_s, 0.0))
        self._travel.flags.writeable = False  # one array for all commands
        super().__init__(config)

    def reset(self) -> None:
        """As after construction."""
        super().reset()
        self.row = 0
        self._guide, self._stroke_end = GuideLine(self.config), StrokeEnd(self.config)
        self._alignment = Alignment(self.config)
        self._speed = self._climbed = 0.0
        self._since = math.nan  # time of the touch in press, and of the arrival in climb [s]
        self._anchor = 0.0  # odometer to hold [m]: at first where the tip was before the vehicle turned to the wall
        self._paused = False

    def _enter(self, inputs: PainterInput, phase: str, reason: str) -> None:
        super()._enter(inputs, phase, reason)
        self._since = math.nan

    # ------------------------------------------------------------------ phases

    def _start(self, inputs: PainterInput, dt: float) -> PaintingCommand:
        config = self.config
        guide = bottom_edge(inputs.lines.values(), config.edge_margin_m, config.gates.start_m)
        if guide is not None and inputs.wall_known and inputs.tared:
            if guide.weight > CERTAIN_WEIGHT and guide.deviation < config.gates.start_deviation_m:
                self._guide.take(guide, config.edge_margin_m)
                found = f"guide {guide.offset * 1e3:+.0f} mm below the tip, wall known, wrench tared"
                self._enter(inputs, "approach", found)
        distance = inputs.distance if inputs.wall_known else config.retreat_m
        return self._command(inputs, contact=False, standoff=max(distance, config.standoff_m), guided=False)

    def _approach(self, inputs: PainterInput, dt: float) -> PaintingCommand:
        config = self.config
        self._follow_guide(inputs, config.gates.start_m)
        if abs(inputs.distance - config.standoff_m) < STANDOFF_REACHED:
            self._enter(inputs, "align", f"stand-off {inputs.distance * 1e3:.0f} mm reached")
        return self._command(inputs, contact=False, standoff=config.standoff_m, hold=True, mark=True)

    def _align(self, inputs: PainterInput, dt: float) -> PaintingCommand:
        config = self.config
        self._follow_guide(inputs, config.gates.row_m)
        line, mark = self._guide.line(inputs), self._start_mark(inputs)
        high = math.inf if line is None else line.offset - self._guide.target
        aside = 0.0 if mark is None else mark.offset - config.edge_margin_m
        if self._alignment.is_reached(inputs, (high, aside), self.entered, dt):
            self._stroke_end.right_margin = mark.offset if mark is not None else None
            self._anchor = float(inputs.odometer[0])
            self._enter(inputs, "press", f"aligned within {self._alignment.error * 1e3:.1f} mm")
        return self._command(inputs, contact=False, standoff=config.standoff_m, hold=True, mark=True)

    def _press(self, inputs: PainterInput, dt: float) -> PaintingCommand:
        config = self.config
        self._follow_guide(inputs, config.gates.row_m)
        self._hold_touch_point(inputs)
        if inputs.in_contact and inputs.time_since_touch > config.press_time_s:
            tolerance = config.press_error * max(inputs.push_reference, PRESS_REFERENCE_MIN)
            if abs(inputs.push - inputs.push_reference) < tolerance:
                self.row = 1
                self._begin_row(inputs, f"push {inputs.push:.1f} N reached")
        return self._command(inputs, contact=True, hold=True, mark=True)

    def _paint(self, inputs: PainterInput, dt: float) -> PaintingCommand:
        config, travel = self.config, travel_of(self.row)
        late = inputs.time_s - self.entered > config.timeout_s + 2.0 * config.stroke_m / config.speed_m_s
        if late:
            self._speed = 0.0
            self._fail(inputs, f"time-out in row {self.row}")
        self._follow_guide(inputs, config.gates.row_m)
        self._guide.slide(self.row, dt)
        if self.row == 1:
            self._guide.tip.look(inputs, dt)
        remaining, edge = self._stroke_end.remaining(inputs, self.row)
        self._pause_without_contact(inputs)
        target = 0.0 if self._paused else stroke_speed(config, remaining)
        self._speed = ramped(self._speed, target, config.acceleration_m_s2 * dt)
        if remaining <= STOP_DISTANCE:
            self._speed = 0.0
        if not late and self._stroke_end.is_reached(inputs, remaining):
            self._end_row(inputs, edge)
        along = travel * self._speed
        return self._command(inputs, contact=True, along=along, edge=edge, edge_rate=-along * dt)

    def _climb(self, inputs: PainterInput, dt: float) -> PaintingCommand:
        config, edge = self.config, self._stroke_end.beside_climb(inputs, self.row - 1)
        self._pause_without_contact(inputs)
        left = config.pitch_m - self._climbed
        target = 0.0 if self._paused else climb_speed(config, left)
        self._speed = ramped(self._speed, target, config.acceleration_m_s2 * dt)
        move = min(self._speed * dt, max(left, 0.0))
        self._climbed += move
        self._guide.target += move
        if left <= 0.0:
            self._speed = 0.0
            if self._climb_settled(inputs):
                edge = None
        return self._command(inputs, contact=True, climb=self._speed, edge=edge, hold=edge is None)

    def _retreat(self, inputs: PainterInput, dt: float) -> PaintingCommand:
        if self._given_up:
            return self._descend(inputs)
        if inputs.distance > self.config.retreat_m - RETREAT_REACHED and not inputs.in_contact:
            self._end(inputs, self.reason if self.failed else self._COMPLETED)
        return self._command(inputs, contact=False, standoff=self.config.retreat_m, hold=True)

    def _done(self, inputs: PainterInput, dt: float) -> PaintingCommand:
        return self._command(inputs, contact=False, standoff=self.config.retreat_m, guided=False)

    # -------------------------------------------------------------------- rows

    def _begin_row(self, inputs: PainterInput, reason: str) -> None:
        self._speed = 0.0
        self._stroke_end.begin_row(self.row, inputs)
        self._enter(inputs, "paint", f"row {self.row}: {reason}")

    def _end_row(self, inputs: PainterInput, edge: TrackedLine | None) -> None:
        self._stroke_end.end_row(self.row, inputs)
        how = "by the odometer" if edge is None else f"at {edge.kind or 'unknown'} edge {edge.offset * 1e3:+.0f} mm"
        if self.row >= self.config.rows:
            self._enter(inputs, "retreat", f"row {self.row} ended {how}; all rows done")
            return
        self.row += 1
        self._climbed, self._speed = 0.0, 0.0
        self._anchor = float(inputs.odometer[0])
        self._enter(inputs, "climb", f"row {self.row - 1} ended {how}")

    def _climb_settled(self, inputs: PainterInput) -> bool:
        """Begin the next row once the fresh edge is found, or was searched for too long; True when it begins."""
        config = self.config
        self._since = inputs.time_s if math.isnan(self._since) else self._since
        waited = inputs.time_s - self._since
        # An old guide near the border of the picture holds the vehicle back (`limits.view`): all lines are displaced.
        fresh = self._guide.fresh(inputs, self._guide.displacement(inputs))
        if fresh is not None and fresh.weight <= CERTAIN_WEIGHT:
            fresh = None
        found = fresh is not None or waited > config.fresh_edge_timeout_s
        near = self._guide.error(inputs) < config.climb_error_m or waited > config.climb_timeout_s
        if not (waited > config.climb_time_s and found and near):
            return False
        if fresh is not None:
            self._guide.take(fresh, fresh.offset)
        why = "no fresh edge; the old guide stays" if fresh is None else "fresh edge found"
        self._begin_row(inputs, f"climbed {self._climbed * 1e3:.0f} mm, {why}")
        return True

    def _hold_touch_point(self, inputs: PainterInput) -> None:
        """Hold the point of the touch: friction holds the tip there, and another target would command a slide."""
        if inputs.in_contact and math.isnan(self._since):
            self._since, self._anchor = inputs.time_s, float(inputs.odometer[0])

    def _pause_without_contact(self, inputs: PainterInput) -> None:
        if not inputs.in_contact and not self._paused:
            self._paused = True
            self.log.append((inputs.time_s, "contact lost", f"in {self.phase}, waiting for it"))
        elif self._paused and inputs.in_contact and inputs.time_since_touch > self.config.contact_back_s:
            self._paused = False
            self.log.append((inputs.time_s, "contact back", "going on"))

    # ------------------------------------------------------------------- lines

    def expected_fresh_edge(self, lines: dict[int, TrackedLine]) -> tuple[float, float] | None:
        """Expected offset [m] of the last row's upper edge while it is not followed, and its side (+1 right, -1 left).

        It is visible only ahead of the brush, on the side of the coming travel.
        """
        if self.row < 2 or self.phase not in ("climb", "paint"):
            return None
        line = lines.get(self._guide.identity)
        followed = line is not None and line.weight > VISIBLE_WEIGHT and line.kind == "paint"
        if followed and self.phase == "paint":
            return None
        left = self.config.pitch_m - self._climbed if self.phase == "climb" else 0.0
        return self._guide.fresh_offset - left, travel_of(self.row)

    def _start_mark(self, inputs: PainterInput) -> TrackedLine | None:
        return start_mark(inputs.lines.values(), self.config.edge_margin_m, self.config.gates.mark_m)

    def _follow_guide(self, inputs: PainterInput, gate: float) -> None:
        """Follow the guide, or choose another line within a gate [m]."""
        if self.row < 2:
            new = self._guide.follow_board(inputs, gate, first_row=self.row == 1)
        else:
            new = self._guide.follow_row(inputs, self.row)
        if new is not None:
            self.log.append((inputs.time_s, "guide", f"track {new.track_id} at {new.offset * 1e3:+.1f} mm"))

    # ----------------------------------------------------------------- command

    def _command(
        self,
        inputs: PainterInput,
        *,
        contact: bool,
        standoff: float = 0.0,
        guided: bool = True,
        hold: bool = False,
        mark: bool = False,
        along: float = 0.0,
        climb: float = 0.0,
        edge: TrackedLine | None = None,
        edge_rate: float = 0.0,
    ) -> PaintingCommand:
        """Command of the tick.

        ``hold`` holds the position on the odometer where no upright line is followed, ``mark`` follows the start mark;
        ``along`` and ``climb`` are speeds along the guide to the right and across it upwards [m/s], ``edge`` ends the
        row and ``edge_rate`` is the change of its target since the last tick [m].
        """
        config, guides, right, slope = self.config, [], 0.0, 0.0
        line = self._guide.line(inputs) if guided else None
        if line is not None:
            guides.append((line, self._guide.target))
            slope = line.angle - 0.5 * math.pi
        start = self._start_mark(inputs) if mark else None
        if start is not None:
            guides.append((start, config.edge_margin_m))
        if edge is not None and edge.weight > 0.0:
            climbs = self.phase == "climb"  # beside the edge at which the row before ended
            guides.append((edge, self._stroke_end.reference(edge, edge_rate, self.row - climbs, reached=climbs)))
        if hold and not any([guide.role == VERTICAL for guide, _ in guides]):
            error = self._anchor - inputs.odometer[0]
            right = clipped(config.hold_gain * error, -config.hold_speed_m_s, config.hold_speed_m_s)
        c, s = math.cos(slope), math.sin(slope)
        velocity = np.array((right + along * c + climb * s, along * s - climb * c))
        travel = self._travel if contact and self._SLIDES else ZERO
        return PaintingCommand(contact, standoff, velocity, guides, config.push_n, ZERO, travel)
