"""The painting strategy: start, survey, approach, align, press; paint, retouch and climb stroke by stroke; retreat.

Everything is in pattern coordinates (u along the strokes, v across; `ibvs_qp.painting.pattern`). Where the tip is and
what leads it: `navigation`; time-outs and failure: `phase_machine`. A "climb" is the step from stroke to stroke, in
whatever direction.
"""

from __future__ import annotations

import math

import numpy as np

from ibvs_qp.painting.alignment import Alignment
from ibvs_qp.painting.along_track import SIGMAS
from ibvs_qp.painting.command import PainterInput, PaintingCommand
from ibvs_qp.painting.navigation import Navigation
from ibvs_qp.painting.pattern import FILL, FILL_REST_M, PLACE_TOLERANCE_M
from ibvs_qp.painting.pattern_lines import CERTAIN_WEIGHT, PatternLine
from ibvs_qp.painting.speed import approached, climb_speed, ramped, stroke_speed
from ibvs_qp.painting.strategy import RETREAT_REACHED
from ibvs_qp.painting.stroke_end import StrokeEnd

#: Difference from the stand-off at which the approach ends [m].
STANDOFF_REACHED = 0.01
#: Least push to which the relative error of a press refers [N].
PRESS_REFERENCE_MIN = 1.0
#: Distance from the beginning of stroke 1 within which the vehicle approaches the wall while it moves there [m].
NEAR_BEGINNING_M = 0.06
#: A touch this far from the beginning of its stroke is taken back [m], at most so often [-], while the edge that shows
#: it is in view: the vehicle sways by 10 mm in hover, and a stroke may err by 10 mm, its end and the estimate included.
TOUCH_ASIDE_M, MOST_TOUCHES = 0.006, 2
#: Least mean speed towards the wall, by which an approach and a touch are given their time [m/s]: the last centimetres
#: are flown at the speed of a touch, 12 mm/s, against errors of the force that no sensor shows.
APPROACH_SPEED, TOUCH_SPEED = 0.05, 6e-3
#: A stroke that ends without an edge is as long as asked if u is known this well [m]; half the tolerance of a length.
CERTAIN_LENGTH_M = 0.005
#: A stroke is as long as asked within this [m].
LENGTH_TOLERANCE_M = 0.01
#: Longest way without an edge of a stroke that is claimed [m]: the odometer, whose direction wanders with the attitude,
#: errs by 3 mm on it in the datasheet world, and by up to 10 mm in the harsh one.
MOST_UNLED_M = 0.4
#: Way without an edge after which a stroke runs farther out until one shows [m], how steeply [-], and how far, over the
#: nominal overlap [-]: steeper than the odometer errs, 1.4 deg in the harsh world.
UNLED_BEFORE_M, ASIDE_SLOPE, MOST_ASIDE = 0.05, 0.06, 0.75
#: Way outwards of a step from stroke to stroke and of an alignment while no edge is in view [m].
ASIDE_M = 0.002
#: Most of the time of painting without contact [-], below this push [N].
MOST_LOST, LOST_N = 0.02, 0.3
#: Last part of a stroke, whose overlap does not count [m].
CORNER_M = 0.02
#: A stroke is at its place, touches the one before, and overlaps it no more than allowed, if that holds at so many
#: standard deviations [-].
PLACE_SIGMAS, GAP_SIGMAS, DEPTH_SIGMAS = 2.0, 2.0, 1.0
#: Last part of a stroke, over which the edge at its end leads [m]: a gust of 2 N rms moves the tip by 15 mm beyond an
#: end where velocity alone holds it. Over more, stiff line rows and the friction of 10 N at 0.7 shake the vehicle.
LEAD_M = 0.05
#: Least speed of the reference towards the end while its edge leads, and towards a beginning [m/s]: 16 mm within the
#: time of a stop.
END_SPEED = 0.02
#: Way ahead from which a stroke takes its target [m]: the tip follows a target that moves within half a second.
REACTION_M = 0.05
#: Target overlap where the stroke before falls short, and the most of a stroke that is claimed, over the nominal
#: overlap [-].
LEAST_OVERLAP, MOST_OVERLAP = 0.75, 3.0
#: Retouches of one stroke [-]; standard deviations by which its overlap must be positive [-]; length that is painted
#: again before the gap [m]; the tip turns this far from the beginning of the stroke [m]: friction lets it slide on, by
#: 11 mm in the datasheet world.
MOST_RETOUCHES, RETOUCH_SIGMAS, RETOUCH_BEFORE_M, TURN_BEFORE_M = 2, 2.5, 0.1, 0.02
#: Target overlap of a retouch over the nominal overlap [-]: the tip runs a quarter of it inside the outer edge that a
#: stroke at its place has left. At 1.5 the innermost of three passes exceeded `MOST_OVERLAP` times the nominal one in 3
#: of 12 flights in the world twice_harsh, at 1.25 in 1.
RETOUCH_OVERLAP = 1.25
#: Most by which the target overlap of a stroke, and of its retouch, exceeds the planned one, over the job's [-]: waves
#: of both strokes add to it, to 24 to 27 mm where a retouch followed a first pass of 17 mm, or a stroke kept its place
#: beside one that swung 8 mm out.
EXCESS, RETOUCH_EXCESS = 0.4, 0.5


class Painter(Navigation):
    """Paints the strokes of a job; `step` returns the command of the tick."""

    _COMPLETED = "all rows painted, retreated"

    def reset(self) -> None:
        """As after construction."""
        super().reset()
        self._alignment, self._stroke_end = Alignment(self.config), StrokeEnd(self.config)
        self._speed = 0.0
        self._since = math.nan  # time of the touch in press, and of the arrival in climb [s]
        self._standoff = math.nan
        self._waypoints: list[tuple[float, float]] = []
        self._uncertain = ""  # why the job is not what was asked, although it was flown to its end
        self._touches = 0  # that were taken back, before the stroke in progress
        self._retouches, self._back_to = 0, math.nan  # of the stroke in progress; u to which the tip goes back [m]
        self._longest = 0.0  # length of the stroke in progress, each pass and overshoot included [m]
        self._painted_s = self._lost_s = 0.0  # time of painting, and of it without contact [s]
        self._lost_m = self._lost_at_ends_m = 0.0  # way of the stroke without contact, and of it near its ends [m]
        self._paused = self._follows_end = False

    def _enter(self, inputs: PainterInput, phase: str, reason: str) -> None:
        super()._enter(inputs, phase, reason)
        self._since = math.nan
        if phase != "retouch":
            self._back_to = math.nan
        if phase in ("paint", "retouch"):
            way = self.config.stroke_m if math.isnan(self._back_to) else 2.0 * abs(self._back_to - self._along.u)
            self._way_s = 2.0 * way / self.config.speed_m_s
        if phase == "survey":
            way = self.config.stroke_m + self.config.gates.first_stop_m
            self._way_s = 2.0 * way / self.config.survey_speed_m_s
        if phase == "approach":
            u, v = self._stroke_begin() - self._along.u, self._v_target - self._cross.v
            self._way_s = abs(u) / self.config.survey_speed_m_s + abs(v) / self.config.climb_speed_m_s
            self._way_s += inputs.distance / APPROACH_SPEED
        if phase == "press":
            self._way_s = self.config.standoff_m / TOUCH_SPEED

    def _waits_for(self, inputs: PainterInput) -> str:
        config, phase = self.config, self.phase
        if phase == "start":
            missing = [("wall", inputs.wall_known), ("tare of the force sensor", inputs.tared)]
            return ", ".join(
                [name for name, there in missing if not there] or ["the board's edge that guides stroke 1"]
            )
        if phase == "survey":
            return f"the edge at the end of stroke 1, {self._along.u:.2f} m flown"
        if phase == "approach":
            u, v = self._stroke_begin() - self._along.u, self._v_target - self._cross.v
            place = max(abs(u), abs(v))
            if place > NEAR_BEGINNING_M:
                return f"the beginning, {place * 1e3:.0f} mm away, limit {NEAR_BEGINNING_M * 1e3:.0f} mm"
            return f"stand-off {inputs.distance:.3f} m, goal {config.standoff_m:g} m within {STANDOFF_REACHED:g} m"
        if phase == "align":
            return self._alignment.state(inputs.time_s - self.entered)
        if phase == "press" and inputs.in_contact:
            within = config.press_error * max(inputs.push_reference, PRESS_REFERENCE_MIN)
            return f"push {inputs.push:.2f} N, commanded {inputs.push_reference:.2f} N, limit {within:.2f} N"
        if phase in ("press", "climb") and not inputs.in_contact:
            return f"contact, tip {inputs.distance * 1e3:.0f} mm from the wall"
        if phase == "climb":
            return f"place {(self._v_target - self._cross.v) * 1e3:+.0f} mm, limit {config.climb_error_m * 1e3:g} mm"
        return f"distance {inputs.distance:.2f} m, goal {config.retreat_m:g} m"

    # ------------------------------------------------------------------ phases

    def _start(self, inputs: PainterInput, dt: float) -> PaintingCommand:
        """Wait for wall, tare and guide; step back for a wider view while no guide is in sight."""
        config = self.config
        if not inputs.wall_known:
            return self._command(inputs, contact=False, standoff=config.retreat_m, guided=False)
        if math.isnan(self._standoff):
            self._standoff = max(inputs.distance, config.standoff_m)
        guide = self._starting_guide()
        if guide is not None and inputs.tared:
            self._cross.start(guide)
            self._v_reference = self._cross.v
            found = f"guide {guide.track.offset * 1e3:+.0f} mm from the tip, wall known, wrench tared"
            self._begin_job(inputs, found)
        elif guide is None and inputs.time_s - self.entered > config.start_look_s:
            widest = max(config.wide_view_m, self._standoff)
            self._standoff = approached(self._standoff, widest, config.survey_speed_m_s * dt)
        return self._command(inputs, contact=False, standoff=self._standoff, guided=False)

    def _starting_guide(self) -> PatternLine | None:
        """The board's edge at which the pattern starts, with the surface on its inner side."""
        expected, gates = -self.config.edge_margin_m, self.config.gates
        found = [line for line in self._lines if line.parallel and line.kind != "paint" and line.side >= 0]
        found = [line for line in found if abs(line.place - expected) < gates.start_m]
        guide = min(found, key=lambda line: abs(line.place - expected), default=None)
        if guide is None or guide.weight <= CERTAIN_WEIGHT or guide.track.deviation >= gates.start_deviation_m:
            return None
        return guide

    def _begin_job(self, inputs: PainterInput, found: str) -> None:
        """Where stroke 1 begins: by its end if that is in view, at the margin from the edge beside, or by a survey."""
        if self._along.find_end(self._lines):
            self._enter(inputs, "approach", f"{found}, stroke 1 begins by the edge at its end")
        elif (mark := self._starting_mark()) is not None:
            self._along.start_at(mark)
            self._enter(inputs, "approach", f"{found}, stroke 1 begins at the margin")
        else:
            self._along.start_here()
            self._enter(inputs, "survey", f"{found}, stroke 1 begins where the edge at its end says")
        self._u_reference = self._along.u

    def _starting_mark(self) -> PatternLine | None:
        """The board's edge beside the beginning of stroke 1, if the tip is at the margin from it."""
        if not self.config.begins_at_margin:
            return None
        margin = self.config.edge_margin_m
        beside = [line for line in self._lines if not line.parallel and line.kind != "paint" and line.side >= 0]
        mark = min(beside, key=lambda line: abs(line.place + margin), default=None)
        if mark is None or mark.weight <= CERTAIN_WEIGHT:
            return None
        gate = self.config.gates.mark_m + SIGMAS * mark.track.deviation
        return mark if abs(mark.place + margin) < gate else None

    def _survey(self, inputs: PainterInput, dt: float) -> PaintingCommand:
        """Fly along stroke 1 until the edge at its end is in view."""
        config = self.config
        if self._along.find_end(self._lines):
            self._u_reference = self._along.u
            self._speed = 0.0
            beginning = f"stroke 1 begins {-self._along.u * 1e3:+.0f} mm from here"
            self._enter(inputs, "approach", f"edge at the end of stroke 1 found, {beginning}")
        elif self._along.u > config.stroke_m + config.gates.first_stop_m:
            self._speed = 0.0
            self._uncertain = "no edge at the end of stroke 1"
            self._enter(inputs, "approach", "no edge at the end of stroke 1: it begins where the vehicle started")
        else:
            self._speed = ramped(self._speed, config.survey_speed_m_s, config.acceleration_m_s2 * dt)
            self._u_reference += self._speed * dt
        self._climb_to(config.edge_margin_m, dt)
        return self._command(inputs, contact=False, standoff=self._standoff, along=self._speed, hold=True)

    def _approach(self, inputs: PainterInput, dt: float) -> PaintingCommand:
        """Move to the beginning of the stroke; then to the stand-off."""
        config = self.config
        u_target = self._stroke_begin()
        u_speed, v_speed = self._move_to(u_target, self._v_target, dt)
        far = max(abs(u_target - self._along.u), abs(self._v_target - self._cross.v)) > NEAR_BEGINNING_M
        standoff = self._standoff if far else config.standoff_m
        if not far and abs(inputs.distance - config.standoff_m) < STANDOFF_REACHED:
            self._enter(inputs, "align", f"stand-off {inputs.distance * 1e3:.0f} mm reached")
        return self._command(inputs, contact=False, standoff=standoff, along=u_speed, climb=v_speed, hold=True)

    def _align(self, inputs: PainterInput, dt: float) -> PaintingCommand:
        unled = self._across_line.line is None
        self._move_to(self._stroke_begin(), self._v_target + (self._aside() if unled else 0.0), dt)
        high = math.inf if unled and not self._is_certain() else self._v_target - self._cross.v
        aside = self._stroke_begin() - self._along.u
        if self._alignment.is_reached(inputs, (high, aside), self.entered, dt):
            self._enter(inputs, "press", f"aligned within {self._alignment.error * 1e3:.1f} mm")
        return self._command(inputs, contact=False, standoff=self.config.standoff_m, hold=True)

    def _press(self, inputs: PainterInput, dt: float) -> PaintingCommand:
        config = self.config
        self._hold_touch_point(inputs)
        if inputs.in_contact and inputs.time_since_touch > config.press_time_s:
            tolerance = config.press_error * max(inputs.push_reference, PRESS_REFERENCE_MIN)
            aside = self._aside_of_beginning()
            if abs(aside) > TOUCH_ASIDE_M and self._touches < MOST_TOUCHES:
                self._touches += 1
                self._enter(inputs, "approach", f"touched {aside * 1e3:+.0f} mm from the beginning")
            elif abs(inputs.push - inputs.push_reference) < tolerance:
                self._begin_stroke(inputs, max(self.row, 1), f"push {inputs.push:.1f} N reached")
        return self._command(inputs, contact=True, hold=True)

    def _paint(self, inputs: PainterInput, dt: float) -> PaintingCommand:
        goal = self._stroke_goal()
        if self._fails_by_time(inputs, f"row {self.row}", goal):
            return self._stroke_command(inputs)
        target = self._touching_target(LEAST_OVERLAP)
        if aside := self._aside(ASIDE_SLOPE * (self._cross.unled - UNLED_BEFORE_M)):
            target = min(target + aside, max(target, self._touching_target(1.0 - MOST_ASIDE, aside)))
        if self._run_towards(inputs, goal, target, dt):
            self._end_stroke(inputs)
        return self._stroke_command(inputs)

    def _retouch(self, inputs: PainterInput, dt: float) -> PaintingCommand:
        """Back along the stroke to where it may leave a gap, then again to its end; farther in both times."""
        back = not math.isnan(self._back_to)
        goal = self._back_to if back else self._stroke_goal()
        if self._fails_by_time(inputs, f"the retouch of row {self.row}", goal):
            return self._stroke_command(inputs)
        first, _ = self._cross.stroke_place(*self._beside(REACTION_M, 0.5 * self.config.brush_width_m))
        farthest = math.inf if math.isnan(first) else first
        target = self._touching_target(RETOUCH_OVERLAP, farthest=farthest, excess=RETOUCH_EXCESS)
        if self._run_towards(inputs, goal, target, dt):
            if back:
                self._back_to = math.nan
                self._cross.end_pass(*self._along.smoothed())
                self._turn_round()
            else:
                self._end_stroke(inputs)
        return self._stroke_command(inputs)

    def _turn_round(self) -> None:
        """The stroke in progress is painted again, one way or the other."""
        self._speed, self._follows_end = 0.0, False
        self._stroke_end.begin()
        self._cross.begin_again()
        self._along.begin_pass()

    def _fails_by_time(self, inputs: PainterInput, name: str, goal: float) -> bool:
        """Whether this phase takes longer than its way allows; the job has then failed."""
        allowed = self.config.timeout_s + self._way_s
        if inputs.time_s - self.entered <= allowed:
            return False
        self._speed, self._follows_end, self._u_reference = 0.0, False, self._along.u
        self._fail(
            inputs, f"time-out in {name}: {abs(goal - self._along.u) * 1e3:.0f} mm are left after {allowed:.0f} s"
        )
        return True

    def _run_towards(self, inputs: PainterInput, goal: float, v: float, dt: float) -> bool:
        """Run on towards a place along the stroke, at a place across it; whether the tip is there."""
        config, travel = self.config, self._view_direction()
        remaining = travel * (goal - self._along.u)
        self._v_reference = self._slid(self._v_reference, v, dt)
        self._pause_without_contact(inputs)
        self._count_contact(inputs.push, remaining, dt)
        self._measure_length(inputs)
        target = 0.0 if self._paused else stroke_speed(config, remaining)
        self._speed = ramped(self._speed, target, config.acceleration_m_s2 * dt)
        if self._stroke_end.is_near(remaining):
            self._speed = 0.0
        self._lead_to_end(remaining, self._speed, dt)
        return self._stroke_end.is_reached(inputs, remaining) and not self._paused

    def _count_contact(self, push: float, remaining: float, dt: float) -> None:
        """Count the time of painting, and time and way without contact; a retouch has paint below it."""
        self._painted_s += dt
        if push > LOST_N:
            return
        self._lost_s += dt
        if self.phase == "paint":
            advance, half = self._view_direction() * self._along.step, 0.5 * self.config.brush_width_m
            self._lost_m = max(self._lost_m + advance, 0.0)
            if not half < remaining < self.config.stroke_m - half:
                self._lost_at_ends_m = max(self._lost_at_ends_m + advance, 0.0)

    def _measure_length(self, inputs: PainterInput) -> None:
        """Measure the paint past both ends of the stroke, to which gusts push the tip; its end by the edge there."""
        if not inputs.in_contact:
            return
        self._behind = max(self._behind, -self.pattern.travel(self.row) * self._along.moved)
        if self._along_line.line is not None:
            self._longest = max(self._longest, self._along.stroke_length)

    def _stroke_command(self, inputs: PainterInput) -> PaintingCommand:
        along = self._view_direction() * self._speed
        return self._command(inputs, contact=True, along=along, edge=self._follows_end)

    def _climb(self, inputs: PainterInput, dt: float) -> PaintingCommand:
        config = self.config
        self._pause_without_contact(inputs)
        self._v_target = self._place(self.row)  # the far edge may come into view
        place = self._v_target + (self._aside() if self._across_line.line is None else 0.0)
        left = place - self._v_reference
        target = 0.0 if self._paused else climb_speed(config, left)
        self._speed = ramped(self._speed, target, config.acceleration_m_s2 * dt)
        self._v_reference += min(self._speed * dt, max(left, 0.0))
        if self._along_line.line is not None and not self._paused:
            self._u_reference = approached(self._u_reference, self._stroke_begin(), END_SPEED * dt)
        if left <= 0.0:
            self._speed, self._v_reference = 0.0, self._slid(self._v_reference, place, dt)
            self._climb_settled(inputs)
        return self._command(inputs, contact=True, climb=self._speed, hold=True)

    def _search(self, inputs: PainterInput, dt: float) -> PaintingCommand:
        """Off the wall, along the last stroke and across it, until its edge is recognised."""
        config = self.config
        if self._is_certain() and self._across_line.line is not None and inputs.time_s - self.entered > 1.0:
            self._waypoints = []
            self._enter(inputs, "approach", f"edge for stroke {self.row} found")
            return self._command(inputs, contact=False, standoff=config.standoff_m, hold=True)
        if not self._waypoints:
            self._fail(inputs, f"stroke {self.row}: the edge of stroke {self.row - 1} was not found")
        else:
            u, v = self._waypoints[0]
            self._move_to(u, v, dt)
            if abs(self._u_reference - u) + abs(self._v_reference - v) < 1e-9 and self._waited(inputs, 1.0):
                self._waypoints.pop(0)
                self._since = math.nan
        return self._command(inputs, contact=False, standoff=config.search_standoff_m, hold=True)

    def _retreat(self, inputs: PainterInput, dt: float) -> PaintingCommand:
        if inputs.distance > self.config.retreat_m - RETREAT_REACHED and not inputs.in_contact:
            if self._uncertain and not self.failed:
                self.failed, self.reason = True, self._uncertain
            self._end(inputs, self.reason if self.failed else self._COMPLETED)
        return self._command(inputs, contact=False, standoff=self.config.retreat_m, hold=True)

    # ----------------------------------------------------------------- strokes

    def _view_direction(self) -> float:
        return super()._view_direction() * (1.0 if math.isnan(self._back_to) else -1.0)

    def _is_last(self) -> bool:
        config = self.config
        if config.rows != FILL:
            return self.row >= int(config.rows)
        rest = self._cross.far_edge - config.edge_margin_m - self._v_target
        return not math.isnan(rest) and rest <= FILL_REST_M

    def _begin_stroke(self, inputs: PainterInput, stroke: int, reason: str) -> None:
        self.row, self._speed, self._follows_end, self._touches = stroke, 0.0, False, 0
        self._retouches, self._longest, self._behind = 0, 0.0, 0.0
        self._lost_m = self._lost_at_ends_m = 0.0
        self._cross.begin_stroke()
        self._along.begin_stroke()
        self._stroke_end.begin()
        # Friction may hold the tip beside its place.
        self._u_reference, self._v_reference = self._along.u, self._cross.v
        self._enter(inputs, "paint", f"row {self.row}: {reason}")

    def _end_stroke(self, inputs: PainterInput) -> None:
        self._longest = max(self._longest, self._along.stroke_length)
        self._cross.end_pass(*self._along.smoothed())
        if self._begin_retouch(inputs):
            return
        self._uncertain = self._uncertain or self._doubt()
        self._cross.end_stroke()
        edge = self._along_line.line
        how = "by the odometer"
        if edge is not None:
            how = f"at {edge.kind or 'unknown'} edge {edge.track.offset * 1e3:+.0f} mm"
        ended = f"row {self.row} ended {how}"
        if self._is_last():
            self._enter(inputs, "retreat", f"{ended}; all rows done")
            return
        self.row += 1
        self._speed, self._u_reference = 0.0, self._along.u
        self._enter(inputs, "climb", ended)

    def _overlap(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Overlap of the stroke that has ended with the last one, as of `CrossTrack.overlap`."""
        last = self._stroke_goal() - CORNER_M * self.pattern.travel(self.row)
        return self._cross.overlap(self._stroke_begin(), last)

    def _begin_retouch(self, inputs: PainterInput) -> bool:
        """Go back to where the stroke may leave a gap to the last one; False where it does not, or cannot be mended."""
        u, overlap, known, _ = self._overlap()
        least = overlap - RETOUCH_SIGMAS * np.hypot(known, self._cross.misfit)
        enough = RETOUCH_OVERLAP * self.config.overlap_m > RETOUCH_SIGMAS * known
        gaps = u[(least < 0.0) & enough & (SIGMAS * known <= 2.0 * self._certain_m)]
        if not gaps.size or self._retouches >= MOST_RETOUCHES or self._cross.longest_unled > MOST_UNLED_M:
            return False
        travel, begin = self.pattern.travel(self.row), self._stroke_begin()
        first = float(gaps.min() if travel > 0.0 else gaps.max())
        self._retouches += 1
        self._back_to = begin + travel * max(travel * (first - begin) - RETOUCH_BEFORE_M, TURN_BEFORE_M)
        self._turn_round()
        short, way = -float(least.min()), abs(self._along.u - self._back_to)
        self._enter(inputs, "retouch", f"row {self.row} may leave a gap of {short * 1e3:.1f} mm, back by {way:.2f} m")
        return True

    def _doubt(self) -> str:
        """Why the stroke that has ended is not claimed: its length or place as estimated, or too little known."""
        painted, asked, goal = self._longest + self._behind, self.config.stroke_m, self._stroke_goal()
        if self._along_line.line is None and self._along.deviation > CERTAIN_LENGTH_M:
            known = self._along.deviation
            return f"row {self.row} ended by the odometer, its length is known to {known * 1e3:.0f} mm"
        ended, known = self._along.stroke_length, self._along.length_deviation
        if abs(ended - asked) + known > LENGTH_TOLERANCE_M:
            return (
                f"row {self.row} is {ended * 1e3:.0f} mm long, known to {known * 1e3:.1f} mm, "
                f"{asked * 1e3:.0f} mm were asked"
            )
        if painted - asked > LENGTH_TOLERANCE_M:  # the greatest of many estimates errs towards more: no margin
            return f"row {self.row} is painted over {painted * 1e3:.0f} mm, {asked * 1e3:.0f} mm were asked"
        if (slip := self._along.slip) > self.config.gates.stop_m:
            return f"row {self.row} met an edge {slip * 1e3:.0f} mm from where the odometer expected it"
        # The brush covers half its width from both sides; beyond an end there is no other side.
        if self._lost_m > 0.5 * self.config.brush_width_m or self._lost_at_ends_m > LENGTH_TOLERANCE_M:
            return f"row {self.row} was without contact over {self._lost_m * 1e3:.0f} mm"
        if self._is_last() and self._lost_s > MOST_LOST * self._painted_s:
            return f"the strokes were without contact for {self._lost_s:.1f} s of {self._painted_s:.1f} s"
        _, overlap, known, largest = self._overlap()
        errs = np.hypot(known, self._cross.misfit)
        if SIGMAS * (worst := known.max(initial=0.0)) > 2.0 * self._certain_m:
            return f"row {self.row} lost its edge, its overlap is known to {worst * 1e3:.1f} mm"
        if (unled := self._cross.longest_unled) > MOST_UNLED_M:
            return f"row {self.row} had no edge to follow for {unled:.2f} m"
        least = (overlap - GAP_SIGMAS * errs).min(initial=math.inf)
        if least < 0.0:
            return f"row {self.row} may leave a gap of {-least * 1e3:.1f} mm to the row before"
        nominal = self._planned_overlap()
        if (most := (largest + DEPTH_SIGMAS * errs).max(initial=0.0)) > MOST_OVERLAP * nominal:
            return f"row {self.row} may overlap the row before by {most * 1e3:.1f} mm, nominal {nominal * 1e3:.1f} mm"
        place, known = self._cross.stroke_place(self._stroke_begin(), goal)
        aside = place - self._v_target
        if not abs(aside) + PLACE_SIGMAS * known <= PLACE_TOLERANCE_M:  # nor where it is not known
            return (
                f"row {self.row} lies {aside * 1e3:+.0f} mm from its place, known to {known * 1e3:.1f} mm, "
                f"limit {PLACE_TOLERANCE_M * 1e3:g} mm"
            )
        return ""

    def _reach_of_last(self, ahead: float, length: float) -> float:
        """Largest v at which the brush still touches the stroke before [m]; infinite where unknown.

        Args:
            ahead: Way ahead of the tip [m].
            length: Length of the piece of the stroke before that is averaged [m].
        """
        last = self._cross.last_stroke(*self._beside(ahead, length))
        return math.inf if math.isnan(last) else last + self.config.brush_width_m

    def _beside(self, ahead: float, length: float) -> tuple[float, float]:
        """First and last u of a piece of a stroke, its middle that far ahead of the tip [m]."""
        here = self._along.u + ahead * self._view_direction()
        return here - 0.5 * length, here + 0.5 * length

    def _nominal_overlap(self) -> float:
        """Overlap of the stroke with the one before at their places [m]; 0 for the first one.

        The last stroke of a filling job may have less than the job's.
        """
        return 0.0 if self.row < 2 else min(self.config.overlap_m, self._planned_overlap())

    def _planned_overlap(self) -> float:
        """Overlap of the stroke with the one before at their places [m]: the last one of a filling job has more."""
        return self.config.brush_width_m - (self._v_target - self._place(self.row - 1))

    def _aside(self, way: float = ASIDE_M) -> float:
        """Way outwards at which an edge shows that the arm hides from a tip that errs inwards [m]."""
        return max(min(way, MOST_ASIDE * self._nominal_overlap()), 0.0)

    def _touching_target(
        self, share: float, aside: float = 0.0, farthest: float = math.inf, excess: float = EXCESS
    ) -> float:
        """Target v [m]: the stroke's place, or beside it where the stroke before lies off its own.

        Args:
            share: Least overlap with the stroke before, over the job's overlap [-].
            aside: Way outwards of the stroke's place [m].
            farthest: Largest target, unless ``excess`` needs a larger one [m].
            excess: Largest overlap less the planned one, over the job's overlap [-].
        """
        reach = self._reach_of_last(REACTION_M, 0.5 * self.config.brush_width_m)
        if math.isinf(reach):
            return min(self._v_target + aside, farthest)
        deepest = reach - self._planned_overlap() - excess * self.config.overlap_m
        return max(min(self._v_target + aside, farthest, reach - share * self._nominal_overlap()), deepest)

    def _lead_to_end(self, remaining: float, speed: float, dt: float) -> None:
        """Over its last centimetres the edge at the end of the stroke leads: from where the tip is, at its speed.

        An overshoot is taken back, and the last millimetres are made up for.
        """
        if self._along_line.line is None or remaining > LEAD_M or not math.isnan(self._back_to):
            self._follows_end = False
            return
        if not self._follows_end:
            self._follows_end, self._u_reference = True, self._along.u
        if not self._paused:
            self._u_reference = approached(self._u_reference, self._stroke_goal(), max(speed, END_SPEED) * dt)

    def _climb_settled(self, inputs: PainterInput) -> None:
        """Begin the stroke at its place once it is known well enough; search for its edge if it stays unknown."""
        config = self.config
        if not self._waited(inputs, config.climb_time_s):
            return
        error, waited = self._v_target - self._cross.v, inputs.time_s - self._since
        if not self._is_certain():
            if waited > config.fresh_edge_timeout_s:
                self._begin_search(inputs)
            return
        if abs(error) < (config.climb_error_m if waited < config.climb_timeout_s else config.climb_stuck_m):
            guide = "no edge in view" if self._across_line.line is None else f"by {self._across_line.line.kind} edge"
            known = f"known to {self._cross.deviation * 1e3:.1f} mm"
            self._begin_stroke(inputs, self.row, f"climbed to {self._v_target * 1e3:.0f} mm, {guide}, {known}")
        elif waited > config.climb_timeout_s:
            self._begin_search(inputs, f"{error * 1e3:+.0f} mm from its place of {config.climb_stuck_m * 1e3:g} mm")

    def _begin_search(self, inputs: PainterInput, why: str = "its edge is not in view") -> None:
        config, begin = self.config, self._stroke_begin()
        back = begin + self._view_direction() * config.search_back_m
        pitch, v = config.pitch_m, self._v_target
        steps = (0.0, -1.0, 1.0, -2.0, 2.0)
        self._waypoints = [(begin, v)] + [(back, v + step * pitch) for step in steps]
        self._standoff = config.search_standoff_m
        self._enter(inputs, "search", f"row {self.row}: {why}")

    # ---------------------------------------------------------------- movement

    def _waited(self, inputs: PainterInput, seconds: float) -> bool:
        """Whether that much time has passed since this was first called in the phase."""
        self._since = inputs.time_s if math.isnan(self._since) else self._since
        return inputs.time_s - self._since > seconds

    def _aside_of_beginning(self) -> float:
        """Larger distance, along or across the strokes, by which the tip misses the beginning of its stroke [m].

        By edges in view only: without one another touch lands no nearer.
        """
        u, v = self._stroke_begin() - self._along.u, self._v_target - self._cross.v
        seen = [u] * (self._along_line.line is not None) + [v] * (self._across_line.line is not None)
        return max(seen, key=abs, default=0.0)

    def _hold_touch_point(self, inputs: PainterInput) -> None:
        """Hold the point of the touch: friction holds the tip there, and another target would command a slide."""
        if inputs.in_contact and math.isnan(self._since):
            self._since, self._u_reference = inputs.time_s, self._along.u

    def _pause_without_contact(self, inputs: PainterInput) -> None:
        if not inputs.in_contact and not self._paused:
            self._paused = True
            self.log.append((inputs.time_s, "contact lost", f"in {self.phase}, waiting for it"))
        elif self._paused and inputs.in_contact and inputs.time_since_touch > self.config.contact_back_s:
            self._paused = False
            self.log.append((inputs.time_s, "contact back", "going on"))
