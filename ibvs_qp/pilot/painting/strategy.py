"""A strategy: estimates of a tick in, targets of the tick out; a subclass has one method, `Strategy.step`."""

from __future__ import annotations

import dataclasses
import math
from abc import ABC, abstractmethod
from collections.abc import Sequence

import numpy as np

from ibvs_qp.config.errors import ConfigError
from ibvs_qp.pilot.painting.command import ExpectedEdge, PainterInput, PaintingCommand
from ibvs_qp.pilot.painting.config import PaintingConfig
from ibvs_qp.validation.failure import raised, type_name
from ibvs_qp.validation.fields import PAINTING_COMMAND
from ibvs_qp.validation.numbers import number, vector

#: Names of the phases in the order of a flight; ``retouch`` stands last because journals of flights store indices.
#: Paint lies where the phase is ``paint``, ``climb`` or ``retouch``.
PHASES = ("start", "survey", "approach", "align", "press", "paint", "climb", "search", "retreat", "done", "retouch")
#: A vehicle has left the wall this far before the retreat distance [m].
RETREAT_REACHED = 0.02
#: Largest offset of a guide [m], and number of a stroke that logs hold.
LARGEST_OFFSET, LARGEST_ROW = 20.0, 1000


class Strategy(ABC):
    """Plan for the tip: a subclass implements `step`; defaults exist for everything else.

    The pilot calls `fly`: it returns the result of `step`. A `step` that raises or returns an invalid command is named
    in `Command.rejected`, and the vehicle leaves the wall; so it does when the supervisor ends the job. A subclass with
    state of its own initialises it in `reset`, which first calls ``super().reset()``.

    Attributes:
        config: The paint job and its settings.
        phase: Name of the phase, one of `PHASES`; `enter` begins one.
        entered: Time at which it began [s].
        row: Stroke in progress from 1, 0 before the first one.
        log: Phases and events: time [s], phase or event, reason.
        finished: Whether the strategy has ended.
        failed: Whether it ended without reaching its aim.
        reason: Why it ended or failed.
        fault: Fault of `step`; empty without one.
        legs: Way of the tip (right, down) in each leg that it paints [m]; leg k is painted in phase ``paint`` while
            `row` is k. The simulator compares them with the truth; empty where they are not known.

    Args:
        config: The paint job and its settings; None takes the defaults.
    """

    legs: Sequence[tuple[float, float]] = ()

    def __init__(self, config: PaintingConfig | None = None) -> None:
        self.config = config or PaintingConfig()
        self.reset()

    def reset(self) -> None:
        """As after construction."""
        self.phase, self.entered, self.row = PHASES[0], 0.0, 0
        self.log: list[tuple[float, str, str]] = []
        self.finished = self.failed = self._leaving = self._abandoned = False
        self.reason = self.fault = ""

    def waits_for(self, inputs: PainterInput) -> str:
        """Condition for which the phase waits, in words; empty for none that is known."""
        return ""

    def adjust(self, push_n: float | None = None, speed_m_s: float | None = None) -> None:
        """Change push [N] and painting speed [m/s] from the next tick on, also after `reset`; None leaves one as it is.

        Raises:
            ConfigError: When a value is out of range; nothing is changed then.
        """
        given = {"push_n": push_n, "speed_m_s": speed_m_s}
        values = {name: value for name, value in given.items() if value is not None}
        self.config = dataclasses.replace(self.config, **values)

    @abstractmethod
    def step(self, inputs: PainterInput) -> PaintingCommand:
        """Targets of one tick.

        Args:
            inputs: Lines in view, odometer, wall and contact.

        Returns:
            The targets: push or stand-off, velocity along the wall, and lines to follow.
        """

    def enter(self, inputs: PainterInput, phase: str, reason: str) -> None:
        """Begin a phase.

        Args:
            inputs: Of this tick.
            phase: One of `PHASES`.
            reason: Why it begins, for the log.
        """
        self.log.append((inputs.time_s, phase, reason))
        self.phase, self.entered = phase, inputs.time_s

    def leave(self, inputs: PainterInput, reason: str, failed: bool = False) -> PaintingCommand:
        """Leave the wall, and end: from the next tick on `step` is not called any more.

        Args:
            inputs: Of this tick.
            reason: Why.
            failed: Whether the aim was not reached.

        Returns:
            The targets of this tick.
        """
        self.failed, self.reason, self._leaving = self.failed or failed, self.reason or reason, True
        self.enter(inputs, "retreat", reason)
        return self._away()

    def fly(self, inputs: PainterInput) -> PaintingCommand:
        """Targets of one tick: those of `step`, or those of the way off the wall; never raises."""
        if self.finished:
            return self._away()
        if self._abandoned:
            return self._descend(inputs)
        if self._leaving:
            return self._retire(inputs)
        try:
            command, fault = _checked(self.step(inputs), inputs)
            fault = fault or self._state_fault()
        except Exception as error:  # in flight nothing may raise; the reason is reported instead
            command, fault = None, raised("strategy", error)
        if command is not None and not fault:
            return command
        self.fault, self.finished = fault, False
        self.log = self.log if type(self.log) is list else []
        return self.leave(inputs, fault, failed=True)

    @property
    def descending(self) -> bool:
        """Whether it has left the wall for good."""
        return self._abandoned

    def abandon(self, inputs: PainterInput, reason: str) -> None:
        """Leave the wall for good: detach, retreat and descend."""
        self.stop(inputs, reason)

    def stop(self, inputs: PainterInput, reason: str) -> None:
        """The same at the supervisor's command: the aim is not reached."""
        self.failed = True
        self._leave_for_good(inputs, reason)

    def expected_edge(self) -> ExpectedEdge | None:
        """A painted edge that should come into view, for perception; None for no such edge."""
        return None

    def _leave_for_good(self, inputs: PainterInput, reason: str) -> None:
        self.reason, self._abandoned = reason, True
        self.enter(inputs, "retreat", reason)

    def _end(self, inputs: PainterInput, reason: str, failed: bool = False) -> None:
        self.failed = self.failed or failed
        self.reason = self.reason or reason
        self.finished = True
        self.enter(inputs, "done", reason)

    def _retire(self, inputs: PainterInput) -> PaintingCommand:
        """Way off the wall until the retreat distance."""
        config, lasted = self.config, inputs.time_s - self.entered
        if inputs.distance > config.retreat_m - RETREAT_REACHED and not inputs.in_contact:
            self._end(inputs, self.reason)
        elif lasted > config.timeout_s:
            self._end(inputs, f"time-out after {lasted:.0f} s in retreat", failed=True)
        return self._away()

    def _descend(self, inputs: PainterInput) -> PaintingCommand:
        """Retreat of a vehicle that has abandoned the wall."""
        config = self.config
        if inputs.time_s - self.entered > config.descend_s:
            self._end(inputs, f"{self.reason}: wall abandoned, descended for {config.descend_s:g} s")
        velocity = np.array([0.0, config.descend_speed_m_s])
        return PaintingCommand(contact=False, standoff=config.retreat_m, velocity=velocity, guides=[], push=0.0)

    def _away(self) -> PaintingCommand:
        """Still, at the retreat distance."""
        return PaintingCommand(contact=False, standoff=self.config.retreat_m, push=self.config.push_n)

    def _state_fault(self) -> str:
        """Fault of phase and row, which others read; empty if they are as documented."""
        if self.phase not in PHASES:
            return f"strategy.phase: {self.phase!r:.40}, not one of {', '.join(PHASES)}"
        if type(self.row) is not int or not 0 <= self.row <= LARGEST_ROW:
            self.row, given = 0, self.row
            return f"strategy.row: {given!r:.40}, not a whole number within 0 to {LARGEST_ROW}"
        return "" if type(self.log) is list else "strategy.log: not a list"


def require_strategy(strategy: object) -> Strategy:
    """The strategy, if the pilot can run it.

    Raises:
        ConfigError: When it is no `Strategy`, or was constructed without its base class.
    """
    if not isinstance(strategy, Strategy):
        raise ConfigError(f"strategy: {type_name(strategy)} is no instance of ibvs_qp.Strategy")
    for name, kind in (("config", PaintingConfig), ("log", list), ("finished", bool)):
        if not isinstance(getattr(strategy, name, None), kind):
            call = "__init__ with super().__init__(config)" if name == "config" else "reset with super().reset()"
            raise ConfigError(f"strategy: {type_name(strategy)} has no {name}; begin its {call}")
    if type(strategy.legs) not in (list, tuple) or not all([_is_leg(leg) for leg in strategy.legs]):
        raise ConfigError(f"strategy: {type_name(strategy)}.legs is no list of finite pairs (right, down) [m]")
    return strategy


def _is_leg(leg: object) -> bool:
    entries = vector(leg, 2)
    return entries is not None and all(map(math.isfinite, entries))


def _checked(command: object, inputs: PainterInput) -> tuple[PaintingCommand | None, str]:
    """A command with plain numbers within bounds, and its fault."""
    if type(command) is not PaintingCommand:
        return None, f"strategy: step returned {type_name(command)}, not a PaintingCommand"
    rejected: list[str] = []
    _, changes, _ = PAINTING_COMMAND.read(command, PAINTING_COMMAND.fallbacks, rejected)
    contact, guides = command.contact, command.guides
    if contact is not True and contact is not False:
        if type(contact) is not np.bool_:
            rejected.append("contact: neither True nor False")
        changes["contact"] = bool(contact)
    if type(guides) not in (list, tuple) or not all([_is_guide(guide, inputs) for guide in guides]):
        rejected.append("guides: not pairs of a line of this tick and its target offset [m]")
    if rejected:
        return None, f"strategy: {'; '.join(rejected)}"
    return (dataclasses.replace(command, **changes) if changes else command), ""


def _is_guide(guide: object, inputs: PainterInput) -> bool:
    if type(guide) not in (list, tuple) or len(guide) != 2:  # type: ignore[arg-type]
        return False
    line, offset = guide  # type: ignore[misc]
    target = number(offset)
    known = any([line is each for each in inputs.lines.values()])
    return known and target is not None and math.fabs(target) <= LARGEST_OFFSET
