"""Data for the figures of a flight, or of one of its rows."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sim.evaluate.paint_plan import PaintPlan, PathError, Segment, band_mask, nominal_plan, path_error
from sim.evaluate.strokes import Stroke, contact_share, on_board
from sim.evaluate.truth import Assessment
from sim.evaluate.window import SETTLED_S, board_tip, contact_clock, in_phase, physics_ticks, tilt_deg, touch_figures
from sim.flight.trace import PAINTED, Trace
from sim.world.board import BoardGeometry


@dataclass(frozen=True, kw_only=True)
class Part:
    """A whole flight, or the ticks that painted one row, once or again, with the climb that leads to it."""

    trace: Trace
    path: PathError
    assessment: Assessment
    ticks: np.ndarray  # control ticks of the part, (N,) bool
    row: int = 0  # number of the row; 0 for a whole flight

    @classmethod
    def whole(cls, trace: Trace) -> Part:
        """The whole flight."""
        ticks = np.ones(len(trace.t), bool)
        return cls(trace=trace, path=path_error(trace), assessment=Assessment(trace), ticks=ticks)

    def rows(self) -> list[Part]:
        """The rows flown."""
        found = []
        for row in range(1, self.stroke_count + 1):
            ticks = (self.path.painting | in_phase(self.trace, "retouch")) & (self.trace.row == row)
            if ticks.any():
                found.append(Part(trace=self.trace, path=self.path, assessment=self.assessment, ticks=ticks, row=row))
        return found

    # ------------------------------------------------------------------ ticks

    @cached_property
    def painting(self) -> np.ndarray:
        """Ticks that paint a row for the first time, or a climb, (N,) bool."""
        return self.ticks & self.path.painting

    @cached_property
    def straight(self) -> np.ndarray:
        """Ticks that paint away from the vertices of the polyline, (N,) bool."""
        return self.painting & ~self.path.corner

    @cached_property
    def corner(self) -> np.ndarray:
        """Ticks that paint near a vertex, (N,) bool."""
        return self.ticks & self.path.corner

    @cached_property
    def released(self) -> np.ndarray:
        """Ticks after the release of the vehicle, (N,) bool."""
        return self.ticks & (self.trace.t >= SETTLED_S)

    # ---------------------------------------------------------------- signals

    @cached_property
    def push_error(self) -> np.ndarray:
        """True minus commanded push, (N,) [N]."""
        return self.trace.push_true - self.trace.push_reference

    @cached_property
    def tilt(self) -> np.ndarray:
        """Angle to the vertical, (N,) [deg]."""
        return tilt_deg(self.trace)

    @cached_property
    def yaw(self) -> np.ndarray:
        """Angle to the wall's normal, (N,) [deg]."""
        return np.degrees(self.trace.euler[:, 2])

    @cached_property
    def _inside(self) -> np.ndarray:
        """Whether every physics step belongs to the part, (M,) bool."""
        return self.ticks[physics_ticks(self.trace)]

    @cached_property
    def contact(self) -> np.ndarray:
        """Push at the physics steps of the part, (K,) [N]."""
        return self.trace.contact_1khz[self._inside]

    @cached_property
    def thrusts(self) -> np.ndarray:
        """Commanded thrusts after the release, (K, n) [N]."""
        return self.trace.thrusts[self.trace.t >= SETTLED_S]

    @cached_property
    def touch(self) -> dict[str, float]:
        """First touch, time to settle and bounces."""
        return touch_figures(self.trace, self.contact, contact_clock(self.trace)[self._inside])

    # ------------------------------------------------------------------- job

    @cached_property
    def segments(self) -> tuple[Segment, ...]:
        """Nominal rows and climbs of the part; none of a strategy of the user's."""
        if self.trace.legs is not None:
            return ()
        return tuple(each for each in nominal_plan(self.trace.scene).segments if self.row in (0, each.row))

    @cached_property
    def strokes(self) -> dict[int, Stroke]:
        """Painted strokes of the part by number."""
        return {number: each for number, each in self.assessment.strokes.items() if self.row in (0, number)}

    @cached_property
    def stroke_count(self) -> int:
        """Strokes of the scene's job; 0 for a strategy of the user's, which has legs."""
        return BoardGeometry(self.trace.scene).strokes if self.trace.legs is None else 0

    @property
    def stroke_m(self) -> float:
        """Length of the shortest stroke; 0 if one is missing."""
        numbers = [self.row] if self.row else range(1, self.stroke_count + 1)
        lengths = [self.strokes[number].length_m if number in self.strokes else 0.0 for number in numbers]
        return min(lengths, default=math.nan)

    @property
    def coverage(self) -> float:
        """Painted fraction of the intended band: discs of the brush's width along the scene's polyline."""
        trace = self.trace
        if trace.coverage_mask is None or not trace.canvas_px_per_m:
            return math.nan
        plan = PaintPlan(segments=self.segments)
        intended = band_mask(trace.scene, plan, trace.coverage_mask.shape[:2], trace.canvas_px_per_m)
        return float(np.mean(trace.coverage_mask[intended] > PAINTED)) if intended.any() else math.nan

    @property
    def contact_share(self) -> float:
        """Fraction of the physics steps of painting that are in contact."""
        return contact_share(self.trace, self.ticks)

    @property
    def off_board_share(self) -> float:
        """Fraction of the painting time, retouches included, with the tip beyond an edge of the board."""
        spots = board_tip(self.trace)[self.painting | (self.ticks & in_phase(self.trace, "retouch"))]
        return float(np.mean(~on_board(self.trace.scene, spots))) if len(spots) else math.nan

    @property
    def claimed(self) -> bool:
        """Whether the pilot ended the job, or this row of it, as planned."""
        if not self.row:
            return bool(self.trace.claimed)
        return bool(np.any(self._after[self._last :]))

    @property
    def reason(self) -> str:
        """Why the flight, or this row of it, ended."""
        if not self.row:
            return self.trace.reason
        ended = self.trace.t[self._last] - 1e-9
        reasons = [event.text for event in self.trace.events if event.kind in self.trace.phases and event.t > ended]
        return reasons[0] if reasons else self.trace.reason

    @property
    def not_completed(self) -> str | None:
        """Missing condition of the job, or of this row of it, by the truth."""
        return self.assessment.of_stroke(self.row) if self.row else self.assessment.shortfall

    @property
    def duration_s(self) -> float:
        """Simulated time [s]."""
        t = self.trace.t
        if not self.row:
            return float(t[-1] - t[0]) if len(t) else 0.0
        return float(np.count_nonzero(self.ticks)) * (float(np.median(np.diff(t))) if len(t) > 1 else 0.0)

    @property
    def velocity_rms(self) -> float:
        """Error of the estimated velocity, rms over its known components [m/s]."""
        error = (self.trace.velocity_estimate - self.trace.velocity)[self.ticks]
        known = np.isfinite(error).any(axis=1)
        return math.sqrt(np.mean(np.nansum(error[known] ** 2, axis=1))) if known.any() else math.nan

    @cached_property
    def _last(self) -> int:
        """Last tick of the part."""
        return int(np.flatnonzero(self.ticks)[-1])

    @cached_property
    def _after(self) -> np.ndarray:
        """Ticks of later rows and of the retreat, (N,) bool."""
        return (self.trace.row > self.row) | in_phase(self.trace, "retreat", "done")
