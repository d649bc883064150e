"""A controller on recorded inputs: whether its commands are bit-identical, and the commands of another preset."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ibvs_qp.command import ActiveLimit, Command
from ibvs_qp.config.errors import ConfigError, out_of_range
from ibvs_qp.estimation.turned_camera import straightened
from ibvs_qp.interfaces.log.header import ASSURED, LAWS, PILOT, recorded_controller
from ibvs_qp.interfaces.log.messages import encode
from ibvs_qp.interfaces.log.reader import RecordedFlight, RecordedTick
from ibvs_qp.interfaces.log.topics import RESET, STEP
from ibvs_qp.model.reporting import fixed_command
from ibvs_qp.pilot import PilotConfig
from ibvs_qp.supervision.assured import Assured

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
    """One field at one tick."""

    tick: int
    stamp_ns: int
    field: str  # of `Command`
    amount: float  # largest difference of its entries; NaN for words
    unit: str = ""
    text: str = ""  # replayed and recorded value, for words


@dataclass(kw_only=True)
class Replay:
    """Result of a replay."""

    ticks: int = 0  # compared
    differing: int = 0
    first: Difference | None = None
    largest: dict[str, Difference] = field(default_factory=dict)  # by field; of words the first difference
    missing: int = 0  # ticks after those compared: the replay ends there, because the controller's state is unknown
    complete: bool = True  # the file has its end; otherwise its writer was killed, or it is damaged

    @property
    def same(self) -> bool:
        """Whether ticks were compared, and all are bit-identical."""
        return self.ticks > 0 and self.first is None


@dataclass(kw_only=True)
class PresetComparison:
    """Commands of the recorded controller and of another, on the same inputs and so without feedback."""

    ticks: int = 0  # of the law, compared
    thrust_rms_n: float = 0.0  # root mean square of the differences over rotors and ticks
    thrust_peak_n: float = 0.0  # largest difference
    peak_tick: int = 0
    push_ticks: int = 0  # with a weight on the push task under both
    push_recorded_n: float = math.nan  # mean force that the push task commands; NaN without such ticks
    push_preset_n: float = math.nan
    push_rms_n: float = math.nan  # root mean square of the difference
    limits_recorded: dict[str, int] = field(default_factory=dict)  # ticks at which each limit was active
    limits_preset: dict[str, int] = field(default_factory=dict)
    missing: int = 0  # as in `Replay`
    complete: bool = True

    @property
    def same(self) -> bool:
        """Whether ticks were compared, and all thrusts are bit-identical."""
        return self.ticks > 0 and self.thrust_peak_n == 0.0


def replay(flight: RecordedFlight, controller: Any = None) -> Replay:
    """Run a controller on the recorded inputs and compare its commands with the recorded ones.

    Args:
        flight: The log.
        controller: The controller, as before its first tick; None builds the recorded one.

    Returns:
        Whether the commands are bit-identical, or where they differ.

    Raises:
        ConfigError: When the recorded controller cannot be built, because it had tasks, limits or a law of its own, or
            the log has another number of rotors.
    """
    controller = recorded_controller(flight.facts) if controller is None else controller
    words = (*WORDS, *_SAFETY) if flight.facts["kind"] == ASSURED else WORDS
    result = Replay()
    for tick in _unbroken(flight, result):
        command = _step(controller, tick)
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
    return result


def replayed(flight: RecordedFlight, controller: Any) -> Iterator[tuple[RecordedTick, Command | None]]:
    """Run a controller, as before its first tick, on the recorded inputs up to the first gap.

    Yields:
        Each tick with the controller's command, None for a reset; the controller is then as after that tick.
    """
    for tick in _unbroken(flight, Replay()):
        yield tick, _step(controller, tick)


def compare_preset(flight: RecordedFlight, preset: PilotConfig) -> PresetComparison:
    """Run the recorded controller and that of a preset on the recorded inputs.

    Args:
        flight: The log.
        preset: Its law and controller are taken; the supervisor's settings, too, where one supervised a controller.

    Returns:
        The comparison.

    Raises:
        ConfigError: When the recorded controller cannot be built, or the preset has another number of rotors.
    """
    kind = flight.facts["kind"]
    law = LAWS[preset.law](straightened(preset.controller) if kind == PILOT else preset.controller)  # type: ignore[abstract]
    recorded, other = recorded_controller(flight.facts), Assured(law, preset.safety) if kind == ASSURED else law
    laws = [each.controller if isinstance(each, Assured) else each for each in (recorded, other)]
    count, counted = (each.config.vehicle.geometry.count for each in laws)
    if count != counted:
        raise out_of_range("--preset", f"{counted} rotors", "", f"the log has {count}")
    result = PresetComparison()
    squares, entries, pushes = 0.0, 0, []
    limits = Counter[str](), Counter[str]()
    for tick in _unbroken(flight, result):
        ours, theirs = _step(recorded, tick), _step(other, tick)
        if ours is None or theirs is None or tick.given.call != STEP:
            continue
        off = np.abs(theirs.thrusts - ours.thrusts)
        squares, entries, result.ticks = squares + float(off @ off), entries + len(off), result.ticks + 1
        if off.max() > result.thrust_peak_n:
            result.thrust_peak_n, result.peak_tick = float(off.max()), tick.given.tick
        for counts, command in zip(limits, (ours, theirs), strict=True):
            counts.update(limit.name for limit in command.active_limits)
        if all(law.setpoints.contact_weight > 0.0 for law in laws):
            pushes.append([law.setpoints.push_command for law in laws])
    result.thrust_rms_n = math.sqrt(squares / max(entries, 1))
    result.limits_recorded, result.limits_preset = map(dict, limits)
    if pushes:
        before, after = np.transpose(pushes)
        result.push_ticks = len(pushes)
        result.push_recorded_n, result.push_preset_n = float(before.mean()), float(after.mean())
        result.push_rms_n = float(np.sqrt(np.mean((after - before) ** 2)))
    return result


def _unbroken(flight: RecordedFlight, result: Replay | PresetComparison) -> Iterator[RecordedTick]:
    """The ticks up to the first gap; the result gets the number missing there."""
    expected = 0
    for tick in flight.ticks():  # to its end, which shows whether the log is complete
        if tick.given.tick != expected and not result.missing:
            result.missing = tick.given.tick - expected
        if not result.missing:
            expected += 1
            yield tick
    result.missing = result.missing or max((flight.count or 0) - expected, 0)
    result.complete = flight.complete


def _step(controller: Any, tick: RecordedTick) -> Command | None:
    """Command of a controller for one recorded tick; None for a reset."""
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
    """Whether active limits are bit-identical; a price may be NaN, which equals nothing."""
    if len(mine) != len(theirs) or not all(isinstance(entry, ActiveLimit) for entry in (*mine, *theirs)):
        return False
    ours, recorded = ([encode(entry).SerializeToString() for entry in limits] for limits in (mine, theirs))
    return ours == recorded


def _short(value: Any) -> str:
    if isinstance(value, tuple):
        return ", ".join(getattr(entry, "name", None) or str(entry) for entry in value)[:200] or "none"
    return str(value)
