"""The painting strategy: start, survey, approach, align, press; paint, retouch and climb stroke by stroke; retreat.

Everything is in pattern coordinates (u along the strokes, v across; `ibvs_qp.pilot.painting.pattern`). Place and
guidance of the tip: `navigation`; targets and claims of a stroke: `stroke`. A "climb" is the step from stroke to
stroke, in any direction.
"""

from __future__ import annotations

import math
from typing import Any

from ibvs_qp.pilot.painting.command import ExpectedEdge, PainterInput, PaintingCommand
from ibvs_qp.pilot.painting.navigation import Navigation
from ibvs_qp.pilot.painting.speed import approached, climb_speed, ramped, stroke_speed
from ibvs_qp.pilot.painting.standstill import STOP_DISTANCE, Alignment, HeldTip, StrokeEnd
from ibvs_qp.pilot.painting.strategy import RETREAT_REACHED, Strategy
from ibvs_qp.pilot.painting.stroke import Stroke

#: Difference from the stand-off at which the approach ends [m]; distance from the beginning of a stroke within which
#: the vehicle approaches the wall while it moves there [m].
STANDOFF_REACHED, NEAR_BEGINNING_M = 0.01, 0.06
#: Least push to which the relative error of a press refers [N].
PRESS_REFERENCE_MIN = 1.0
#: A touch this far from the beginning of its stroke is taken back [m], at most so often [-], while the edge that shows
#: it is in view: the vehicle sways by 10 mm in hover, and a stroke may err by 10 mm in all.
TOUCH_ASIDE_M, MOST_TOUCHES = 0.006, 2
#: Least mean speed towards the wall, which sets the time of an approach and of a touch [m/s]; a touch is flown at
#: 12 mm/s, against errors of the force that no sensor shows.
APPROACH_SPEED, TOUCH_SPEED = 0.05, 6e-3
#: Last part of a stroke, over which the edge at its end leads [m], against gusts; over more, stiff line rows and the
#: friction of 10 N at 0.7 shake the vehicle. Least speed of the reference there, and towards a beginning [m/s].
LEAD_M, END_SPEED = 0.05, 0.02
#: Time at one place of a search [s].
SEARCH_S = 1.0
#: Phases without the common time-out.
_UNTIMED = ("paint", "retouch", "search", "done")


class Painter(Strategy):
    """Paints the strokes of a job."""

    _COMPLETED = "all rows painted, retreated"
    _SLIDES = True  # whether a stroke follows the press

    def adjust(self, push_n: float | None = None, speed_m_s: float | None = None) -> None:
        """See `Strategy.adjust`."""
        before = self.config.speed_m_s
        super().adjust(push_n, speed_m_s)
        if self.phase in ("paint", "retouch"):
            self._way_s *= before / self.config.speed_m_s
        self._tip.config = self._held.config = self.config

    def reset(self) -> None:
        """As after construction."""
        super().reset()
        self._tip = tip = Navigation(self.config)
        self._stroke = Stroke(self.config, tip.cross, tip.along, number=1, place=self.config.edge_margin_m)
        self._alignment, self._stroke_end = Alignment(self.config), StrokeEnd(self.config)
        self._held = HeldTip(self.config)
        self._last_time = self._standoff = math.nan
        self._way_s = 0.0  # time of the way in this phase, added to the time-out [s]
        self._since = math.inf  # time of the touch in press, and of the arrival in climb and search [s]
        self._speed = 0.0
        self._waypoints: list[tuple[float, float]] = []
        self._uncertain = ""  # why the job differs from the specified one, although it was flown to its end
        self._paused = self._follows_end = False

    def step(self, inputs: PainterInput) -> PaintingCommand:
        """Advance by one tick."""
        dt = 0.0 if math.isnan(self._last_time) else inputs.time_s - self._last_time
        self._last_time = inputs.time_s
        self._held.ease(dt)
        self.log += self._tip.update(inputs, dt, self.phase, self._stroke)
        if inputs.time_s - self.entered > self.config.timeout_s + self._way_s and self.phase not in _UNTIMED:
            self._time_out(inputs)
        return getattr(self, f"_{self.phase}")(inputs, dt)

    def expected_edge(self) -> ExpectedEdge | None:
        """The painted edge to look for: the last stroke's outer one, ahead; for stroke 1 its own, behind the brush.

        Without `vision.paint_color`, perception finds edges of paint only where they are expected, and only an edge of
        the stroke being laid shows where the picture has the tip.
        """
        stroke, half = self._stroke, 0.5 * self.config.brush_width_m
        if self.row == 1 and self.phase == "paint":
            return self._tip.expected_edge(half, -stroke.travel)
        if self.row > 1 and self.phase in ("climb", "paint", "search"):
            last = stroke.nominal_place(self.row - 1) - self._tip.cross.v
            return self._tip.expected_edge(half + last, stroke.travel)
        return None

    def _enter(self, inputs: PainterInput, phase: str, reason: str) -> None:
        config, stroke, tip = self.config, self._stroke, self._tip
        self.enter(inputs, phase, reason)
        self._since = math.inf
        self._held.release()
        if phase != "retouch":
            stroke.back_to = math.nan
        u, v = stroke.way
        along, across = abs(u) / config.survey_speed_m_s, abs(v) / config.climb_speed_m_s
        painted = 2.0 * abs(stroke.back_to - tip.along.u) if stroke.goes_back else config.stroke_m
        self._way_s = {
            "survey": 2.0 * (config.stroke_m + config.gates.first_stop_m) / config.survey_speed_m_s,
            "approach": along + across + inputs.distance / APPROACH_SPEED,
            "press": config.standoff_m / TOUCH_SPEED,
            "paint": 2.0 * painted / config.speed_m_s,
            "retouch": 2.0 * painted / config.speed_m_s,
        }.get(phase, 0.0)

    def _time_out(self, inputs: PainterInput) -> None:
        reason = f"time-out after {inputs.time_s - self.entered:.0f} s in {self.phase}: {self.waits_for(inputs)}"
        if self.phase == "retreat":
            self._end(inputs, reason, failed=True)
        else:
            self._fail(inputs, reason)

    def _fail(self, inputs: PainterInput, reason: str) -> None:
        self.failed, self.reason = True, self.reason or reason
        self._enter(inputs, "retreat", reason)

    def waits_for(self, inputs: PainterInput) -> str:
        """Condition for which the phase waits, with value and limit."""
        config, phase, (u, v) = self.config, self.phase, self._stroke.way
        if phase == "start":
            needed = (("wall", inputs.wall_known), ("tare of the force sensor", inputs.tared))
            missing = [name for name, there in needed if not there]
            return ", ".join(missing) or "the board's edge that guides stroke 1"
        if phase == "survey":
            return f"the edge at the end of stroke 1, {self._tip.along.u:.2f} m flown"
        if phase == "approach" and (place := max(abs(u), abs(v))) > NEAR_BEGINNING_M:
            return f"the beginning, {place * 1e3:.0f} mm away, limit {NEAR_BEGINNING_M * 1e3:.0f} mm"
        if phase == "approach":
            return f"stand-off {inputs.distance:.3f} m, goal {config.standoff_m:g} m within {STANDOFF_REACHED:g} m"
        if phase == "align":
            return self._alignment.state(inputs.time_s - self.entered)
        if phase in ("press", "climb") and not inputs.in_contact:
            return f"contact, tip {inputs.distance * 1e3:.0f} mm from the wall"
        if phase == "press":
            within = self._press_tolerance(inputs)
            return f"push {inputs.push:.2f} N, commanded {inputs.push_reference:.2f} N, limit {within:.2f} N"
        if phase == "climb":
            return f"place {v * 1e3:+.0f} mm, limit {config.climb_error_m * 1e3:g} mm"
        if phase == "retreat":
            return f"distance {inputs.distance:.2f} m, goal {config.retreat_m:g} m"
        return f"the end of the {phase}, {self._tip.along.u:.2f} m along the stroke"

    def _start(self, inputs: PainterInput, dt: float) -> PaintingCommand:
        """Wait for wall, tare and guide; step back for a wider view while no guide is in sight."""
        config, tip = self.config, self._tip
        if not inputs.wall_known:
            return tip.command(contact=False, standoff=config.retreat_m, guided=False)
        if math.isnan(self._standoff):
            self._standoff = max(inputs.distance, config.standoff_m)
        guide = tip.starting_guide()
        if guide is not None and inputs.tared:
            tip.cross.start(guide)
            found = f"guide {guide.track.offset * 1e3:+.0f} mm from the tip, wall known, wrench tared"
            self._begin_job(inputs, found)
            tip.hold()
        elif guide is None and inputs.time_s - self.entered > config.start_look_s:
            widest = max(config.wide_view_m, self._standoff)
            self._standoff = approached(self._standoff, widest, config.survey_speed_m_s * dt)
        return tip.command(contact=False, standoff=self._standoff, guided=False)

    def _begin_job(self, inputs: PainterInput, found: str) -> None:
        """Where stroke 1 begins: by its end if that is in view, at the margin from the edge beside, or by a survey."""
        along, lines = self._tip.along, self._tip.lines
        if along.find_end(lines):
            self._enter(inputs, "approach", f"{found}, stroke 1 begins by the edge at its end")
        elif along.find_mark(lines):
            self._enter(inputs, "approach", f"{found}, stroke 1 begins at the margin")
        else:
            along.start_here()
            self._enter(inputs, "survey", f"{found}, stroke 1 begins by the edge at its end")

    def _survey(self, inputs: PainterInput, dt: float) -> PaintingCommand:
        """Fly along stroke 1 until the edge at its end is in view."""
        config, tip = self.config, self._tip
        if tip.along.find_end(tip.lines):
            self._speed, tip.u_reference = 0.0, tip.along.u
            beginning = f"stroke 1 begins {-tip.along.u * 1e3:+.0f} mm from here"
            self._enter(inputs, "approach", f"edge at the end of stroke 1 found, {beginning}")
        elif tip.along.u > config.stroke_m + config.gates.first_stop_m:
            self._speed, self._uncertain = 0.0, "no edge at the end of stroke 1"
            self._enter(inputs, "approach", "no edge at the end of stroke 1: it begins where the vehicle started")
        else:
            self._speed = ramped(self._speed, config.survey_speed_m_s, config.acceleration_m_s2 * dt)
            tip.u_reference += self._speed * dt
        tip.move_to(tip.u_reference, config.edge_margin_m, dt)
        return tip.command(contact=False, standoff=self._standoff, speed=(self._speed, 0.0), hold=True)

    def _approach(self, inputs: PainterInput, dt: float) -> PaintingCommand:
        """Move to the beginning of the stroke; then to the stand-off."""
        tip, stroke = self._tip, self._stroke
        speed = tip.move_to(stroke.begin, stroke.place, dt)
        far = max(map(abs, stroke.way)) > NEAR_BEGINNING_M
        standoff = self._standoff if far else self.config.standoff_m
        if not far and abs(inputs.distance - standoff) < STANDOFF_REACHED:
            self._enter(inputs, "align", f"stand-off {inputs.distance * 1e3:.0f} mm reached")
        return tip.command(contact=False, standoff=standoff, speed=speed, hold=True)

    def _align(self, inputs: PainterInput, dt: float) -> PaintingCommand:
        tip, stroke = self._tip, self._stroke
        aside, high = stroke.way
        place = stroke.place
        if tip.guide is None:
            place += stroke.aside()
            high = high if stroke.is_certain else math.inf
        tip.move_to(stroke.begin, place, dt)
        if self._alignment.is_reached(inputs, (high, aside), self.entered, dt):
            self._enter(inputs, "press", f"aligned within {self._alignment.error * 1e3:.1f} mm")
        return tip.command(contact=False, standoff=self.config.standoff_m, hold=True)

    def _press(self, inputs: PainterInput, dt: float) -> PaintingCommand:
        tip, stroke = self._tip, self._stroke
        self._hold_touch_point(inputs)
        if inputs.in_contact and inputs.time_since_touch > self.config.press_time_s:
            u, v = stroke.way  # by edges in view only: without one another touch lands no nearer
            seen = [u] * (tip.mark is not None) + [v] * (tip.guide is not None)
            aside = max(seen, key=abs, default=0.0)
            if abs(aside) > TOUCH_ASIDE_M and stroke.touches < MOST_TOUCHES:
                stroke.touches += 1
                self._enter(inputs, "approach", f"touched {aside * 1e3:+.0f} mm from the beginning")
            elif abs(inputs.push - inputs.push_reference) < self._press_tolerance(inputs):
                self._begin_stroke(inputs, f"push {inputs.push:.1f} N reached")
        return self._on_the_wall(hold=True)

    def _press_tolerance(self, inputs: PainterInput) -> float:
        return self.config.press_error * max(inputs.push_reference, PRESS_REFERENCE_MIN)

    def _hold_touch_point(self, inputs: PainterInput) -> None:
        """Hold the point of the touch: friction holds the tip there, and another target would command a slide."""
        if inputs.in_contact and math.isinf(self._since):
            self._since, self._tip.u_reference = inputs.time_s, self._tip.along.u

    def _begin_stroke(self, inputs: PainterInput, reason: str) -> None:
        tip, self.row = self._tip, self._stroke.number
        self._speed, self._follows_end, self._stroke_end = 0.0, False, StrokeEnd(self.config)
        tip.cross.begin_stroke()
        tip.along.begin_stroke()
        tip.hold()  # friction may hold the tip beside its place
        self._enter(inputs, "paint", f"row {self.row}: {reason}")

    def _paint(self, inputs: PainterInput, dt: float) -> PaintingCommand:
        """Run to the end of the stroke; in a retouch first back to before the gap, and farther in both times."""
        tip, stroke, again = self._tip, self._stroke, self.phase == "retouch"
        goal, allowed = stroke.back_to if stroke.goes_back else stroke.goal, self.config.timeout_s + self._way_s
        if inputs.time_s - self.entered > allowed:
            self._speed, self._follows_end, tip.u_reference = 0.0, False, tip.along.u
            name, left = f"the retouch of row {self.row}" if again else f"row {self.row}", abs(goal - tip.along.u)
            self._fail(inputs, f"time-out in {name}: {left * 1e3:.0f} mm are left after {allowed:.0f} s")
        elif self._run_towards(inputs, goal, stroke.retouch_target() if again else stroke.target(), dt):
            if stroke.goes_back:
                stroke.back_to = math.nan
                tip.cross.strokes.end_pass(*tip.along.smoothed())
                self._turn_round()
            else:
                self._end_stroke(inputs)
        return self._on_the_wall(speed=(self._stroke.direction * self._speed, 0.0), edge=self._follows_end)

    _retouch = _paint

    def _turn_round(self) -> None:
        """The stroke in progress is painted again, one way or the other."""
        self._speed, self._follows_end, self._stroke_end = 0.0, False, StrokeEnd(self.config)
        self._tip.cross.begin_again()
        self._tip.along.begin_pass()

    def _run_towards(self, inputs: PainterInput, goal: float, v: float, dt: float) -> bool:
        """Run on towards a place along the stroke, at a place across it; whether the tip is there."""
        tip, stroke, config = self._tip, self._stroke, self.config
        remaining = stroke.direction * (goal - tip.along.u)
        tip.slide_to(v, dt)
        self._pause_without_contact(inputs)
        stroke.count(inputs, dt)
        if inputs.in_contact and tip.mark is not None:
            stroke.measure()  # an overshoot, by the edge
        target = 0.0 if self._paused or self._held.rests else stroke_speed(config, remaining)
        self._speed = ramped(self._speed, target, config.acceleration_m_s2 * dt)
        if remaining <= STOP_DISTANCE:
            self._speed = 0.0
        self._held.watch(self._speed, stroke.direction * tip.along.step, dt)
        self._lead_to_end(remaining, dt)
        return self._stroke_end.is_reached(inputs, remaining) and not self._paused

    def _lead_to_end(self, remaining: float, dt: float) -> None:
        """Over its last centimetres the edge at the end of the stroke leads: from where the tip is, at its speed.

        An overshoot is taken back, and the last millimetres are made up for.
        """
        tip, before = self._tip, self._follows_end
        self._follows_end = tip.mark is not None and remaining <= LEAD_M and not self._stroke.goes_back
        if self._follows_end and (not before or self._held.rests):
            tip.u_reference = tip.along.u
        if self._follows_end and not self._paused and not self._held.rests:
            step = max(self._speed, END_SPEED) * dt
            tip.u_reference = approached(tip.u_reference, self._stroke.goal, step)

    def _end_stroke(self, inputs: PainterInput) -> None:
        tip, stroke = self._tip, self._stroke
        stroke.measure()
        tip.cross.strokes.end_pass(*tip.along.smoothed())
        if gap := stroke.turn_back():
            self._turn_round()
            self._enter(inputs, "retouch", gap)
            return
        self._uncertain = self._uncertain or stroke.doubt(by_edge=tip.mark is not None)
        tip.cross.end_stroke()
        how = "by the odometer"
        if tip.mark is not None:
            how = f"at {tip.mark.kind or 'unknown'} edge {tip.mark.track.offset * 1e3:+.0f} mm"
        ended = f"row {self.row} ended {how}"
        if stroke.is_last:
            self._enter(inputs, "retreat", f"{ended}; all rows done")
            return
        self._stroke = stroke.following()
        self.row, self._speed, tip.u_reference = self._stroke.number, 0.0, tip.along.u
        self._enter(inputs, "climb", ended)

    def _climb(self, inputs: PainterInput, dt: float) -> PaintingCommand:
        config, tip, stroke = self.config, self._tip, self._stroke
        self._pause_without_contact(inputs)
        stroke.place = stroke.nominal_place(stroke.number)  # the far edge may come into view
        place = stroke.place + (stroke.aside() if tip.guide is None else 0.0)
        left = place - tip.v_reference
        target = 0.0 if self._paused else climb_speed(config, left)
        self._speed = ramped(self._speed, target, config.acceleration_m_s2 * dt)
        tip.v_reference += min(self._speed * dt, max(left, 0.0))
        if tip.mark is not None and not self._paused:
            tip.u_reference = approached(tip.u_reference, stroke.begin, END_SPEED * dt)
        if left <= 0.0:
            self._speed = 0.0
            tip.slide_to(place, dt)
            self._settle(inputs)
        return self._on_the_wall(speed=(0.0, self._speed), hold=True)

    def _settle(self, inputs: PainterInput) -> None:
        """Begin the stroke at its place once it is known well enough; search for its edge if it stays unknown."""
        config, stroke, tip = self.config, self._stroke, self._tip
        if not self._waited(inputs, config.climb_time_s):
            return
        (_, error), waited = stroke.way, inputs.time_s - self._since
        if not stroke.is_certain:
            if waited > config.fresh_edge_timeout_s:
                self._begin_search(inputs, "its edge is not in view")
        elif abs(error) < (config.climb_error_m if waited < config.climb_timeout_s else config.climb_stuck_m):
            guide = "no edge in view" if tip.guide is None else f"by {tip.guide.kind} edge"
            known = f"known to {tip.cross.deviation * 1e3:.1f} mm"
            self._begin_stroke(inputs, f"climbed to {stroke.place * 1e3:.0f} mm, {guide}, {known}")
        elif waited > config.climb_timeout_s:
            self._begin_search(inputs, f"{error * 1e3:+.0f} mm from its place of {config.climb_stuck_m * 1e3:g} mm")

    def _waited(self, inputs: PainterInput, seconds: float) -> bool:
        """Whether that much time has passed since this was first called in the phase."""
        self._since = min(self._since, inputs.time_s)
        return inputs.time_s - self._since > seconds

    def _pause_without_contact(self, inputs: PainterInput) -> None:
        if not inputs.in_contact and not self._paused:
            self._paused = True
            self.log.append((inputs.time_s, "contact lost", f"in {self.phase}, waiting for it"))
        elif self._paused and inputs.in_contact and inputs.time_since_touch > self.config.contact_back_s:
            self._paused = False
            self.log.append((inputs.time_s, "contact back", "going on"))

    def _on_the_wall(self, **targets: Any) -> PaintingCommand:
        """Command with contact, as of `Navigation.command`."""
        travel = self.config.speed_m_s * self._stroke.direction if self._SLIDES else 0.0
        command = self._tip.command(contact=True, travel=travel, **targets)
        command.push *= self._held.push
        return command

    def _begin_search(self, inputs: PainterInput, why: str) -> None:
        config, stroke = self.config, self._stroke
        begin, v, pitch = stroke.begin, stroke.place, config.pitch_m
        back = begin + stroke.direction * config.search_back_m
        self._waypoints = [(begin, v)] + [(back, v + step * pitch) for step in (0.0, -1.0, 1.0, -2.0, 2.0)]
        self._standoff = config.search_standoff_m
        self._enter(inputs, "search", f"row {self.row}: {why}")

    def _search(self, inputs: PainterInput, dt: float) -> PaintingCommand:
        """Off the wall, along the last stroke and across it, until its edge is recognised."""
        config, tip, standoff = self.config, self._tip, self.config.search_standoff_m
        if self._stroke.is_certain and tip.guide is not None and inputs.time_s - self.entered > SEARCH_S:
            self._enter(inputs, "approach", f"edge for stroke {self.row} found")
            standoff = config.standoff_m
        elif not self._waypoints:
            self._fail(inputs, f"stroke {self.row}: the edge of stroke {self.row - 1} was not found")
        else:
            u, v = self._waypoints[0]
            tip.move_to(u, v, dt)
            if abs(tip.u_reference - u) + abs(tip.v_reference - v) < 1e-9 and self._waited(inputs, SEARCH_S):
                self._waypoints.pop(0)
                self._since = math.inf
        return tip.command(contact=False, standoff=standoff, hold=True)

    def _retreat(self, inputs: PainterInput, dt: float) -> PaintingCommand:
        if inputs.distance > self.config.retreat_m - RETREAT_REACHED and not inputs.in_contact:
            if self._uncertain and not self.failed:
                self.failed, self.reason = True, self._uncertain
            self._end(inputs, self.reason if self.failed else self._COMPLETED)
        return self._tip.command(contact=False, standoff=self.config.retreat_m, hold=True)

    def _done(self, inputs: PainterInput, dt: float) -> PaintingCommand:
        return self._away()
