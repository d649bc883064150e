"""Phases of a strategy: transitions with their log, time-outs, failure and the end."""

from __future__ import annotations

import math

import numpy as np

from ibvs_qp.painting.command import PainterInput, PaintingCommand
from ibvs_qp.painting.config import PaintingConfig


class PhaseMachine:
    """Runs one method per phase: `_start`, ..., `_retreat`, `_done`, each from (inputs, dt) to a command.

    Attributes:
        phase: Name of the phase.
        entered: Time at which it began [s].
        log: Transitions and events: time [s], phase or event, reason.
        finished: Whether the strategy has ended.
        failed: Whether it ended without reaching its aim.
        reason: Why it ended or failed.
    """

    #: Phases without the common time-out.
    _UNTIMED = ("paint", "survey", "search", "done")

    def __init__(self, config: PaintingConfig) -> None:
        self.config = config
        self.reset()

    def reset(self) -> None:
        """As after construction."""
        self.phase, self.entered = "start", 0.0
        self.log: list[tuple[float, str, str]] = []
        self.finished = self.failed = self._given_up = False
        self.reason = ""
        self._last_time = math.nan
        self._way_s = 0.0  # time of the way in this phase, beside the time-out [s]

    def step(self, inputs: PainterInput) -> PaintingCommand:
        """Advance by one tick."""
        dt = 0.0 if math.isnan(self._last_time) else inputs.time_s - self._last_time
        self._last_time = inputs.time_s
        if inputs.time_s - self.entered > self.config.timeout_s + self._way_s and self.phase not in self._UNTIMED:
            self._time_out(inputs)
        return getattr(self, "_" + self.phase)(inputs, dt)

    @property
    def descending(self) -> bool:
        """Whether it has left the wall for good."""
        return self._given_up

    def abandon(self, inputs: PainterInput, reason: str) -> None:
        """Leave the wall for good: detach, retreat and descend."""
        self.stop(inputs, reason)

    def stop(self, inputs: PainterInput, reason: str) -> None:
        """The same at the supervisor's command: the aim is not reached."""
        self.failed = True
        self._give_up(inputs, reason)

    def _enter(self, inputs: PainterInput, phase: str, reason: str) -> None:
        self.log.append((inputs.time_s, phase, reason))
        self.phase, self.entered, self._way_s = phase, inputs.time_s, 0.0

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

    def _give_up(self, inputs: PainterInput, reason: str) -> None:
        self.reason, self._given_up = reason, True
        self._enter(inputs, "retreat", reason)

    def _end(self, inputs: PainterInput, reason: str, failed: bool = False) -> None:
        self.failed = self.failed or failed
        self.reason = self.reason or reason
        self.finished = True
        self._enter(inputs, "done", reason)

    def _descend(self, inputs: PainterInput) -> PaintingCommand:
        """Retreat of a vehicle that has given up the wall."""
        config = self.config
        if inputs.time_s - self.entered > config.descend_s:
            self._end(inputs, f"{self.reason}: wall given up, descended for {config.descend_s:g} s")
        velocity = np.array([0.0, config.descend_speed_m_s])
        return PaintingCommand(contact=False, standoff=config.retreat_m, velocity=velocity, guides=[], push=0.0)
