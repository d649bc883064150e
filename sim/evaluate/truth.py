"""Whether a flight did its job, by the simulator's truth and not by the pilot's claim."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sim.evaluate.strokes import Stroke, contact_share, painted_strokes
from sim.evaluate.window import CONTACT_N, board_tip, in_phase
from sim.flight.trace import CRASH, INTERRUPTED, KILLED, LANDED, TIME_OUT, Trace
from sim.world.board import BoardGeometry
from sim.world.worlds import HARSH, world_name

#: A stroke is at its place within this distance of its nominal line [m]: the overlap of two strokes.
PLACE_M = 0.008
#: Largest overlap with the stroke before, as a multiple of the nominal one.
MOST_OVERLAP = 3.0
#: Largest error of the length of a stroke [m].
LENGTH_M = 0.01
#: A hole in a stroke is longer than half the brush's width, which a round brush covers except for slivers, by this [m].
HOLE_M = 0.01
#: Rounding of the tip's place: strokes that touch may differ by it [m].
ROUNDING_M = 1e-6
#: Least contact while painting, and in gusts or in the harsh world.
CONTACT, ROUGH_CONTACT = 0.98, 0.90
#: The vehicle has left the wall when its tip is this far from the board at the end [m].
DETACHED_M = 0.10
#: A slide has moved the tip by at least this fraction of speed times duration.
SLID = 0.5
#: Lengths are shown in whole millimetres from this one on [m].
WHOLE_M = 0.01
#: Phases of a plan may be shorter than planned by this [s]: a few control ticks.
TICKS_S = 0.02


@dataclass(frozen=True)
class Assessment:
    """A flight against its job.

    Args:
        trace: The flight.
    """

    trace: Trace

    @cached_property
    def strokes(self) -> dict[int, Stroke]:
        """Painted strokes of the scene by number."""
        return painted_strokes(self.trace) if self.trace.legs is None else {}

    @cached_property
    def shortfall(self) -> str | None:
        """Missing condition of the job, named by stroke or phase; None for a completed one."""
        if self.trace.legs is not None:
            job = self._legs(self.trace.legs)
        else:
            job = self._pressed() if self.trace.plan else self._painted()
        found = [*self._ends(), *job, *self._retreat()]
        return "; ".join(found) or None

    @property
    def completed(self) -> bool:
        """Whether nothing is missing."""
        return self.shortfall is None

    @property
    def least_contact(self) -> float:
        """Contact that painting needs in the world flown."""
        scene = self.trace.scene
        gusts = scene.wind.gust_n_rms > 0.0 or max(scene.errors.air.gust_n) > 0.0
        rough = gusts or world_name(scene.errors) == HARSH
        return ROUGH_CONTACT if rough else CONTACT

    def of_stroke(self, number: int) -> str | None:
        """Missing condition of a stroke; None for a good one."""
        return "; ".join(self._stroke(number)) or None

    @property
    def _word(self) -> str:
        """Row or column."""
        return self.trace.scene.paint.pattern.removesuffix("s")

    def _ends(self) -> Iterator[str]:
        """Ends of a flight that complete no job, after any course."""
        reason = self.trace.reason
        if any(reason.startswith(end) for end in (CRASH, INTERRUPTED, KILLED)) or TIME_OUT in reason:
            yield reason

    def _painted(self) -> Iterator[str]:
        board = BoardGeometry(self.trace.scene)
        for number in range(1, board.strokes + 1):
            if missing := self.of_stroke(number):
                yield f"{self._word} {number}: {missing}"
        yield from self._contact()

    def _contact(self) -> Iterator[str]:
        share = contact_share(self.trace, in_phase(self.trace, "paint", "retouch", "climb"))
        if share < self.least_contact:
            yield f"contact in {100.0 * share:.1f} % of painting, {100.0 * self.least_contact:g} % needed"

    def _legs(self, legs: Sequence[tuple[float, float]]) -> Iterator[str]:
        """Legs of a strategy of the user's by the way of the tip in contact; without legs only its claim counts."""
        if not legs and not self.trace.claimed:
            yield self.trace.reason
        for number, (right, down) in enumerate(legs, start=1):
            if missing := self._leg(number, np.array((right, -down))):
                yield f"leg {number}: {missing}"
        yield from self._contact()

    def _leg(self, number: int, asked: np.ndarray) -> str:
        """Shortfall of a leg; ``asked`` is its vector on the board (along, up) [m]."""
        touching = in_phase(self.trace, "paint") & (self.trace.row == number) & (self.trace.push_true > CONTACT_N)
        spots = board_tip(self.trace)[touching]
        if not len(spots):
            return "not painted"
        way, length = spots - spots[0], float(np.hypot(*asked))
        along = asked / max(length, ROUNDING_M)
        flown, aside = way @ along, way @ np.array((-along[1], along[0]))
        if abs(flown[-1] - length) > LENGTH_M:
            return f"{flown[-1]:.3f} m long, {length:.3f} m asked"
        if abs(aside[-1]) > LENGTH_M:
            return f"it ends {_mm(abs(aside[-1]))} from its line"
        stray = float(np.abs(aside - aside.mean()).max())
        return f"{_mm(stray)} from its mean line" if stray > PLACE_M else ""

    def _stroke(self, number: int) -> Iterator[str]:
        stroke, paint = self.strokes.get(number), self.trace.scene.paint
        if stroke is None:
            yield "not painted"
            return
        if abs(stroke.place_error_m) > PLACE_M:
            yield f"{_mm(abs(stroke.place_error_m))} from its place"
        if stroke.overlap_m < -ROUNDING_M:
            yield f"gap of {_mm(-stroke.overlap_m)} to {self._word} {number - 1}"
        if stroke.most_overlap_m > MOST_OVERLAP * stroke.nominal_overlap_m + ROUNDING_M:
            yield (
                f"overlaps {self._word} {number - 1} by {_mm(stroke.most_overlap_m)}, "
                f"nominal {_mm(stroke.nominal_overlap_m)}"
            )
        if abs(stroke.length_m - paint.stroke_m) > LENGTH_M:
            yield f"{stroke.length_m:.3f} m long, {paint.stroke_m:.3f} m asked"
        if stroke.hole_m > (limit := 0.5 * paint.brush_width_m + HOLE_M):
            yield f"a hole: no contact over {_mm(stroke.hole_m)}, limit {_mm(limit)}"

    def _retreat(self) -> Iterator[str]:
        trace = self.trace
        if not len(trace.t) or not in_phase(trace, "retreat", "done").any():
            yield "no retreat"
        elif trace.push_true[-1] > CONTACT_N or -trace.tip[-1, 0] < DETACHED_M:
            yield f"no retreat: the tip ends {_mm(-float(trace.tip[-1, 0]))} from the board"

    def _pressed(self) -> Iterator[str]:
        """Phases of a press: held after the touch, slid; after a loss that ended it, descended."""
        trace, plan = self.trace, self.trace.plan
        press = np.flatnonzero(in_phase(trace, "press") & (trace.push_true > CONTACT_N))
        if not len(press):
            yield "no touch"
            return
        pressing = np.flatnonzero(in_phase(trace, "press"))
        held = float(trace.t[pressing[-1]] - trace.t[press[0]])
        if held < plan["press"] - TICKS_S:
            yield from self._descended(held)
            return
        if plan["paint"] > 0.0:
            yield from self._slid()

    def _slid(self) -> Iterator[str]:
        trace, asked_s = self.trace, self.trace.plan["paint"]
        sliding = np.flatnonzero(in_phase(trace, "paint"))
        slid = float(trace.t[sliding[-1]] - trace.t[sliding[0]]) if len(sliding) else 0.0
        if slid < asked_s - TICKS_S:
            yield from self._descended(slid, "slid")
            return
        along = board_tip(trace)[sliding, 0]
        way, least = float(along[0] - along[-1]), SLID * asked_s * trace.scene.paint.speed_m_s
        if way < least:
            yield f"slid {_mm(way)}, at least {_mm(least)} needed"

    def _descended(self, lasted: float, action: str = "held") -> Iterator[str]:
        """A press that a fault ended: the plan is then to leave the wall and to land, or to descend for a time."""
        trace = self.trace
        if not any(event.kind == "fault" for event in trace.events):
            yield f"{action} for {lasted:.1f} s, {trace.plan['press' if action == 'held' else 'paint']:g} s asked"
            return
        leaving = np.flatnonzero(in_phase(trace, "retreat"))
        descended = float(trace.t[-1] - trace.t[leaving[0]]) if len(leaving) else 0.0
        if trace.reason != LANDED and descended < trace.plan["descend"] - TICKS_S:
            yield f"descended for {descended:.1f} s, {trace.plan['descend']:g} s asked"


def _mm(value_m: float) -> str:
    if not math.isfinite(value_m):
        return "unknown"
    return f"{1e3 * value_m:.{0 if abs(value_m) >= WHOLE_M else 1}f} mm"
