"""Phases of a strategy, one method each: transitions, time-outs, failure."""

from __future__ import annotations

import math

from ibvs_qp.painting.command import PainterInput, PaintingCommand
from ibvs_qp.painting.strategy import Strategy


class PhaseMachine(Strategy):
    """Runs one method per phase: `_start`, ..., `_retreat`, `_done`, each from (inputs, dt) to a command."""

    #: Phases without the common time-out.
    _UNTIMED = ("paint", "retouch", "search", "done")

    def reset(self) -> None:
        """As after construction."""
        super().reset()
        self._last_time = math.nan
        self._way_s = 0.0  # time of the way in this phase, beside the time-out [s]

    def step(self, inputs: PainterInput) -> PaintingCommand:
        """Advance by one tick."""
        dt = 0.0 if math.isnan(self._last_time) else inputs.time_s - self._last_time
        self._last_time = inputs.time_s
        if inputs.time_s - self.entered > self.config.timeout_s + self._way_s and self.phase not in self._UNTIMED:
            self._time_out(inputs)
        return getattr(self, "_" + self.phase)(inputs, dt)

    def _enter(self, inputs: PainterInput, phase: str, reason: str) -> None:
        self.enter(inputs, phase, reason)
        self._way_s = 0.0

    def _waits_for(self, inputs: PainterInput) -> str:
        """What the phase waits for, with value and limit."""
        return ""

    def _time_out(self, inputs: PainterInput) -> None:
        reason = f"time-out after {inputs.time_s - self.entered:.0f} s in {self.phase}"
        if missing := self._waits_for(inputs):
            reason += f": {missing}"
        if self.phase == "retreat":
            self._end(inputs, reason, failed=True)
        else:
            self._fail(inputs, reason)

    def _fail(self, inputs: PainterInput, reason: str) -> None:
        self.failed, self.reason = True, self.reason or reason
        self._enter(inputs, "retreat", reason)

    def _done(self, inputs: PainterInput, dt: float) -> PaintingCommand:
        return self._away()
