"""Recorded inputs through a controller: the same commands to the bit, or where not, and what another would command."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ibvs_qp.command import ActiveLimit, Command
from ibvs_qp.config.errors import ConfigError
from ibvs_qp.model.reporting import fixed_command
from ibvs_qp.recording.header import CONTROLLER, PILOT, flown_controller
from ibvs_qp.recording.messages import encode
from ibvs_qp.recording.reader import RecordedFlight, RecordedTick
from ibvs_qp.recording.ticks import RESET

#: Fields that are compared, and their units; durations differ from run to run, tasks follow from thrusts and inputs.
NUMBERS = {
    "thrusts": "N",
    "wrench": "N, N m",
    "unallocated_wrench": "N, N m",
    "reach_margin": "N",
    "iterations": "",
}
WORDS = ("outcome", "mode", "rejected", "active_limits")
#: Those of a supervised controller; a pilot's supervisor is not replayed.
_SAFETY = ("safety", "safety_reasons")


@dataclass(frozen=True, kw_only=True)
class Difference:
    """One field at one tick.

    Attributes:
        tick: Number of the tick.
        stamp_ns: Its time.
        field: Name of the field of `Command`.
        amount: Largest difference of its entries, in `unit`; NaN for words.
        unit: Unit.
        text: Replayed and recorded value, for words.
    """

    tick: int
    stamp_ns: int
    field: str
    amount: float
    unit: str = ""
    text: str = ""


@dataclass(kw_only=True)
class Replay:
    """Result of a replay.

    Attributes:
        ticks: Ticks compared.
        differing: Ticks that differ.
        first: First difference, or None.
        largest: Largest difference of every field of numbers that differs, and the first one of every other field.
        missing: Ticks missing after those compared: the replay ends there, because the controller's state is unknown.
        complete: Whether the file has its end; otherwise its writer was killed, or it is damaged.
    """

    ticks: int = 0
    differing: int = 0
    first: Difference | None = None
    largest: dict[str, Difference] = field(default_factory=dict)
    missing: int = 0
    complete: bool = True

    @property
    def same(self) -> bool:
        """Whether ticks were compared, and all are the same to the bit."""
        return self.ticks > 0 and self.first is None


def step(controller: Any, tick: RecordedTick) -> Command | None:
    """Command of a controller for one recorded tick; None for a reset.

    Raises:
        ConfigError: When the supervisor's thrusts are those of another number of rotors.
    """
    given = tick.given
    if given.call == RESET:
        controller.reset()
        return None
    if given.fixed_thrusts is not None and tick.command is not None:
        rotors, fixed = controller.config.vehicle.geometry.count, len(given.fixed_thrusts)
        if fixed != rotors:
            raise ConfigError(f"tick {given.tick}: {fixed} thrusts of the supervisor, {rotors} rotors of the law")
        return fixed_command(controller.setpoints, tick.command.stamp_ns, given.fixed_thrusts, ())
    return controller.step(given.measurement, given.reference, given.contact)


def replay(flight: RecordedFlight, controller: Any = None) -> Replay:
    """Run a controller on the recorded inputs and compare its commands with the recorded ones.

    Args:
        flight: The log.
        controller: The controller, as before its first tick; None builds the recorded one.

    Returns:
        Equal to the bit, or where not.

    Raises:
        ConfigError: When the recorded controller cannot be built, because it had tasks, limits or a law of its own, or
            the log has another number of rotors.
    """
    controller = flown_controller(flight.facts) if controller is None else controller
    words = WORDS if flight.facts["kind"] in (PILOT, CONTROLLER) else (*WORDS, *_SAFETY)
    result = Replay()
    for tick in unbroken(flight, result):
        command = step(controller, tick)
        if command is None or tick.command is None:
            continue
        result.ticks += 1
        differences = list(_differences(tick.given.tick, command, tick.command, words))
        result.differing += bool(differences)
        for found in differences:
            result.first = result.first or found
            before = result.largest.get(found.field)
            if before is None or found.amount > before.amount:
                result.largest[found.field] = found
    result.complete = flight.complete
    return result


def unbroken(flight: RecordedFlight, result: Any) -> Iterator[RecordedTick]:
    """The ticks up to the first gap; what is missing there goes into the result."""
    expected = 0
    for tick in flight.ticks():  # to its end, which says whether the log is complete
        if tick.given.tick != expected and not result.missing:
            result.missing = tick.given.tick - expected
        if not result.missing:
            expected += 1
            yield tick
    result.missing = result.missing or max((flight.count or 0) - expected, 0)


def _differences(tick: int, ours: Command, recorded: Command, words: tuple[str, ...]) -> Iterator[Difference]:
    for name, unit in NUMBERS.items():
        mine, theirs = (np.atleast_1d(np.asarray(getattr(each, name), float)) for each in (ours, recorded))
        if mine.shape != theirs.shape:
            text = f"{mine.size} entries instead of {theirs.size}"
            yield Difference(tick=tick, stamp_ns=recorded.stamp_ns, field=name, amount=np.inf, unit=unit, text=text)
        elif mine.tobytes() != theirs.tobytes():
            with np.errstate(invalid="ignore"):
                amount = float(np.nan_to_num(np.abs(mine - theirs), nan=np.inf).max())
            yield Difference(tick=tick, stamp_ns=recorded.stamp_ns, field=name, amount=amount, unit=unit)
    for name in words:
        mine, theirs = getattr(ours, name), getattr(recorded, name)
        if mine != theirs and not _same_limits(mine, theirs):
            text = f"{_short(mine)} instead of {_short(theirs)}"
            yield Difference(tick=tick, stamp_ns=recorded.stamp_ns, field=name, amount=np.nan, text=text)


def _same_limits(mine: Any, theirs: Any) -> bool:
    """Whether active limits are equal to the bit; a price may be NaN, which equals nothing."""
    both = (*mine, *theirs)
    if len(mine) != len(theirs) or not all(isinstance(entry, ActiveLimit) for entry in both):
        return False
    ours, recorded = ([encode(entry).SerializeToString() for entry in limits] for limits in (mine, theirs))
    return ours == recorded


def _short(value: Any) -> str:
    if isinstance(value, tuple):
        return ", ".join(getattr(entry, "name", None) or str(entry) for entry in value)[:200] or "none"
    return str(value)
