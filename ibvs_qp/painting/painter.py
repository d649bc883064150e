"""Painting strategy: from what is seen and felt to the reference of the controller, row by row.

Everything is in metres around the tip's wall point (see `TrackedLine`). The line that leads:
`ibvs_qp.painting.guide_line`; where a row ends: `ibvs_qp.painting.stroke_end`.
"""

from __future__ import annotations

import math

import numpy as np

from ibvs_qp.estimation.wall_motion import TrackedLine
from ibvs_qp.measurement import VERTICAL
from ibvs_qp.painting.guide_line import Guide
from ibvs_qp.painting.job import NONE, PaintingConfig, Scenery, Wish, clipped
from ibvs_qp.painting.line_choice import ROW_GATE, START_GATE, bottom_edge, start_mark
from ibvs_qp.painting.stroke_end import RowEnd, travel_of

#: Nobody sets out for a guide known less well than this [m].
START_DEVIATION = 0.01
#: Errors and speed of the alignment are averaged over this time [s]: half a period of the sway in hover.
SWAY_TIME = 0.4
#: Farthest that the alignment's tolerances open: 15 mm and 25 mm/s, what 3 N rms of gusts leave.
MOST_OPENING = 5.0
#: Stiction may keep the tip from the last millimetres; a stop settles for this long at most [s].
SETTLE_TIME = 0.8
#: Position hold along the wall by the odometer [1/s], speed-limited [m/s].
HOLD_GAIN, HOLD_SPEED = 0.8, 0.03
#: Vertical speed of a vehicle that gives up the wall [m/s], down: slow, because nothing measures the height.
DESCENT_M_S = 0.15


class Painter:
    """Phase machine of the paint job; `step` returns the wish of the tick."""

    _slides = True  # whether a stroke follows the press

    def __init__(self, config: PaintingConfig) -> None:
        self.config = config
        self._travel = np.array((-config.speed_m_s, 0.0))
        self._travel.flags.writeable = False  # shared by all wishes
        self.reset()

    def reset(self) -> None:
        """Back to the start."""
        self.phase, self.row, self.entered = "start", 0, 0.0
        self.log: list[tuple[float, str, str]] = []
        self._calm: tuple[float, ...] | None = None
        self.finished = self.failed = self._given_up = False
        self.reason = ""
        self._guide = Guide(self.config)
        self._row_end = RowEnd(self.config)
        self._speed = 0.0
        self._since = math.nan
        self._anchor = 0.0  # row 1 begins where the tip was at the start, before the vehicle turned to the wall
        self._last_time = math.nan
        self._paused = False
        self._climbed = 0.0

    # ------------------------------------------------------------------ phases

    def step(self, seen: Scenery) -> Wish:
        """Advance the phase machine by one tick."""
        dt = 0.0 if math.isnan(self._last_time) else seen.time_s - self._last_time
        self._last_time = seen.time_s
        if seen.time_s - self.entered > self.config.timeout_s and self.phase not in ("paint", "done"):
            self._time_out(seen)
        return getattr(self, "_" + self.phase)(seen, dt)

    def _enter(self, seen: Scenery, phase: str, reason: str) -> None:
        self.log.append((seen.time_s, phase, reason))
        self.phase, self.entered, self._since = phase, seen.time_s, math.nan

    def _time_out(self, seen: Scenery) -> None:
        if self.phase == "retreat":
            self._end(seen, f"time-out after {self.config.timeout_s:g} s in retreat", failed=True)
            return
        self._fail(seen, f"time-out after {self.config.timeout_s:g} s in {self.phase}")

    def _fail(self, seen: Scenery, reason: str) -> None:
        self.failed, self.reason = True, self.reason or reason
        self._speed = 0.0
        self._enter(seen, "retreat", reason)

    def abandon(self, seen: Scenery, reason: str) -> None:
        """Give up the wall for good: detach, get clear of it and descend."""
        self.failed = True
        self._give_up(seen, reason)

    def _give_up(self, seen: Scenery, reason: str) -> None:
        self.reason, self._given_up = reason, True
        self._enter(seen, "retreat", reason)

    def _escape(self, seen: Scenery, dt: float) -> Wish:
        if seen.time_s - self.entered > self.config.descend_s:
            self._end(seen, f"{self.reason}: wall given up, descended for {self.config.descend_s:g} s")
        velocity = np.array([0.0, DESCENT_M_S])
        return Wish(contact=False, standoff=self.config.retreat_m, velocity=velocity, guides=[], push=0.0)

    def _end(self, seen: Scenery, reason: str, failed: bool = False) -> None:
        self.failed = self.failed or failed
        self.reason = self.reason or reason
        self.finished = True
        self._enter(seen, "done", reason)

    def _start(self, seen: Scenery, dt: float) -> Wish:
        guide = bottom_edge(seen.lines.values(), self.config.edge_margin_m, START_GATE)
        sure = guide is not None and guide.weight > 0.9 and guide.deviation < START_DEVIATION
        if guide is not None and sure and seen.wall_known and seen.tared:
            self._guide.take(guide, self.config.edge_margin_m)
            self._enter(seen, "approach", f"guide {guide.offset * 1e3:+.0f} mm below the tip, wall known, wrench tared")
        distance = seen.distance if seen.wall_known else self.config.retreat_m
        return self._wish(seen, contact=False, standoff=max(distance, self.config.standoff_m), guided=False)

    def _approach(self, seen: Scenery, dt: float) -> Wish:
        self._keep_guide(seen, START_GATE)
        if abs(seen.distance - self.config.standoff_m) < 0.01:
            self._enter(seen, "align", f"stand-off {seen.distance * 1e3:.0f} mm reached")
        return self._wish(seen, contact=False, standoff=self.config.standoff_m, hold=True, mark=True)

    def _align(self, seen: Scenery, dt: float) -> Wish:
        self._keep_guide(seen)
        line, mark = self._guide.line(seen), self._start_mark(seen)
        high = math.inf if line is None else line.offset - self._guide.target
        aside = 0.0 if mark is None else mark.offset - self.config.edge_margin_m
        error, speed = self._without_sway((high, aside, *seen.velocity[:2]), dt)
        # Gusts and noisy pictures may never let the vehicle stand still: what counts as aligned opens with time.
        waited = (seen.time_s - self.entered) / self.config.align_patience_s
        opening = min(max(1.0, waited**2), MOST_OPENING)
        still = speed < opening * self.config.align_speed_m_s
        if error < opening * self.config.align_error_m and still:
            self._since = seen.time_s if math.isnan(self._since) else self._since
            if seen.time_s - self._since >= self.config.align_time_s:
                self._row_end.right_margin = mark.offset if mark is not None else None
                self._anchor = float(seen.odometer[0])
                self._enter(seen, "press", f"aligned within {error * 1e3:.1f} mm")
        else:
            self._since = math.nan
        return self._wish(seen, contact=False, standoff=self.config.standoff_m, hold=True, mark=True)

    def _without_sway(self, now: tuple[float, ...], dt: float) -> tuple[float, float]:
        """Error and speed averaged over a sway: a hovering vehicle sways by as much as is allowed, about its place."""
        if not all(map(math.isfinite, now)):
            self._calm = None
            return math.inf, math.inf
        share = 1.0 - math.exp(-dt / SWAY_TIME)
        last = self._calm or now
        self._calm = tuple(old + share * (new - old) for old, new in zip(last, now, strict=True))
        high, aside, right, down = self._calm
        return max(abs(high), abs(aside)), math.hypot(right, down)

    def _hold_where_it_touched(self, seen: Scenery) -> None:
        """A tip that is pressed is held by friction: to wish it elsewhere would be to wish a slide."""
        if seen.in_contact and math.isnan(self._since):
            self._since, self._anchor = seen.time_s, float(seen.odometer[0])

    def _press(self, seen: Scenery, dt: float) -> Wish:
        self._keep_guide(seen)
        self._hold_where_it_touched(seen)
        settled = seen.in_contact and seen.time_since_touch > 1.2
        if settled and abs(seen.push - seen.push_wanted) < 0.15 * max(seen.push_wanted, 1.0):
            self.row = 1
            self._row_end.begin_first_row(float(seen.odometer[0]))
            self._begin_row(seen, f"push {seen.push:.1f} N held")
        return self._wish(seen, contact=True, hold=True, mark=True)

    def _begin_row(self, seen: Scenery, reason: str) -> None:
        self._speed = 0.0
        self._row_end.forget()
        self._enter(seen, "paint", f"row {self.row}: {reason}")

    def _paint(self, seen: Scenery, dt: float) -> Wish:
        config = self.config
        if seen.time_s - self.entered > config.timeout_s + 2.0 * config.stroke_m / config.speed_m_s:
            self._fail(seen, f"time-out in row {self.row}")
        self._keep_guide(seen)
        self._guide.slide(self.row, dt)
        travel = travel_of(self.row)
        remaining, edge = self._row_end.remaining(seen, self.row)
        self._check_contact(seen)
        left = remaining if remaining > 0.0 else 0.0
        speed = min(config.speed_m_s, math.sqrt(2.0 * config.acceleration_m_s2 * left), 2.0 * left + 0.005)
        step = config.acceleration_m_s2 * dt
        self._speed += clipped((0.0 if self._paused else speed) - self._speed, -2.0 * step, step)
        if remaining <= 0.004:
            self._speed = 0.0
            self._since = seen.time_s if math.isnan(self._since) else self._since
            still = abs(seen.velocity[0]) < 2.0 * config.align_speed_m_s
            waited = seen.time_s - self._since
            if (waited > 0.15 and still and remaining < 0.003) or waited > SETTLE_TIME:
                self._end_row(seen, edge)
        return self._wish(
            seen, contact=True, along=travel * self._speed, edge=edge, edge_rate=-travel * self._speed * dt
        )

    def _end_row(self, seen: Scenery, edge: TrackedLine | None) -> None:
        if self.row == 1:
            self._row_end.end_first_row(float(seen.odometer[0]))
        how = f"at {edge.kind or 'unknown'} edge {edge.offset * 1e3:+.0f} mm" if edge is not None else "by the odometer"
        if self.row >= self.config.rows:
            self._enter(seen, "retreat", f"row {self.row} ended {how}; all rows done")
            return
        self.row += 1
        self._climbed, self._speed = 0.0, 0.0
        self._anchor = float(seen.odometer[0])
        self._enter(seen, "climb", f"row {self.row - 1} ended {how}")

    def _climb(self, seen: Scenery, dt: float) -> Wish:
        config, edge = self.config, self._row_end.beside_climb(seen, self.row - 1)
        self._check_contact(seen)
        left = config.pitch_m - self._climbed
        speed = min(config.climb_speed_m_s, math.sqrt(2.0 * config.acceleration_m_s2 * max(left, 0.0)) + 0.002)
        speed = 0.0 if self._paused else speed
        step = config.acceleration_m_s2 * dt
        self._speed += clipped(speed - self._speed, -2.0 * step, step)
        move = min(self._speed * dt, max(left, 0.0))
        self._climbed += move
        self._guide.target += move
        if left <= 0.0:
            self._speed = 0.0
            self._since = seen.time_s if math.isnan(self._since) else self._since
            waited = seen.time_s - self._since
            fresh = self._guide.fresh(seen)
            good = fresh is not None and fresh.weight > 0.9
            if waited > 0.3 and (good or waited > 2.0) and (self._guide.error(seen) < 0.004 or waited > 1.0):
                why = "fresh edge found" if good else "no fresh edge; the old guide stays"
                if good and fresh is not None:
                    self._guide.take(fresh, fresh.offset)
                self._begin_row(seen, f"climbed {self._climbed * 1e3:.0f} mm, {why}")
                edge = None
        return self._wish(seen, contact=True, climb=self._speed if left > 0.0 else 0.0, edge=edge, hold=edge is None)

    def _retreat(self, seen: Scenery, dt: float) -> Wish:
        if self._given_up:
            return self._escape(seen, dt)
        if seen.distance > self.config.retreat_m - 0.02 and not seen.in_contact:
            self._end(seen, "all rows painted, retreated" if not self.failed else self.reason)
        return self._wish(seen, contact=False, standoff=self.config.retreat_m, hold=True)

    def _done(self, seen: Scenery, dt: float) -> Wish:
        return self._wish(seen, contact=False, standoff=self.config.retreat_m, guided=False)

    # ------------------------------------------------------------- association

    def expected_fresh_edge(self, lines: dict[int, TrackedLine]) -> tuple[float, float] | None:
        """Where the last row's upper edge must be while it is not followed: offset [m] and side it lies to (+-1).

        It exists only ahead of the brush, to the side of the coming travel (+1 right, -1 left).
        """
        if self.row < 2 or self.phase not in ("climb", "paint"):
            return None
        line = lines.get(self._guide.identity)
        followed = line is not None and line.weight > 0.5 and line.kind == "paint"
        if followed and self.phase == "paint":
            return None
        left = self.config.pitch_m - self._climbed if self.phase == "climb" else 0.0
        return self.config.fresh_edge_m - left, travel_of(self.row)

    def _start_mark(self, seen: Scenery) -> TrackedLine | None:
        return start_mark(seen.lines.values(), self.config.edge_margin_m)

    def _keep_guide(self, seen: Scenery, gate: float = ROW_GATE) -> None:
        """Stay with the guide, or take the line that has to lead now."""
        if self.row < 2:
            new = self._guide.keep_board(seen, gate, leads=self.row == 1)
        else:
            new = self._guide.keep_row(seen, self.row)
        if new is not None:
            self.log.append((seen.time_s, "guide", f"track {new.track_id} at {new.offset * 1e3:+.1f} mm"))

    def _check_contact(self, seen: Scenery) -> None:
        if not seen.in_contact and not self._paused:
            self._paused = True
            self.log.append((seen.time_s, "contact lost", f"in {self.phase}, waiting for it"))
        elif self._paused and seen.in_contact and seen.time_since_touch > 0.5:
            self._paused = False
            self.log.append((seen.time_s, "contact back", "going on"))

    # ------------------------------------------------------------------ wishes

    def _wish(
        self,
        seen: Scenery,
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
    ) -> Wish:
        guides: list[tuple[TrackedLine, float]] = []
        right = 0.0
        line = self._guide.line(seen) if guided else None
        slope = 0.0
        if line is not None:
            guides.append((line, self._guide.target))
            slope = line.angle - 0.5 * math.pi
        if mark:
            start = self._start_mark(seen)
            if start is not None:
                guides.append((start, self.config.edge_margin_m))
        if edge is not None and edge.weight > 0.0:
            climbs = self.phase == "climb"  # beside the edge at which the row before ended
            wanted = self._row_end.reference(edge, edge_rate, self.row - climbs, reached=climbs)
            guides.append((edge, wanted))
        if hold and not any([entry.role == VERTICAL for entry, _ in guides]):
            right = clipped(HOLD_GAIN * (self._anchor - seen.odometer[0]), -HOLD_SPEED, HOLD_SPEED)
        c, s = math.cos(slope), math.sin(slope)
        velocity = np.array((right + along * c + climb * s, along * s - climb * c))
        travel = self._travel if contact and self._slides else NONE
        return Wish(contact, standoff, velocity, guides, self.config.push_n, NONE, travel)
