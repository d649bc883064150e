"""Recorded flights through a controller or a pilot with hostile inputs in between, and what must hold at every tick."""

from __future__ import annotations

import copy
import dataclasses
import functools
import itertools
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import unusable
from hostile import Mutator
from recorded_inputs import arrays_in, recording

from ibvs_qp.command import Command, Outcome, SafetyState

#: Ticks of good inputs after which a flight agrees with one that saw no others: 0.5 s.
RECOVERY = 125
#: From the last recorded tick to the first one of the next lap [ns].
LAP_STEP = 4_000_000
#: Rounding of the rate limit [N].
ROUNDING = 1e-9
#: Beginnings of rejections that name a caught exception, which no input of these may cause.
RAISED = ("step:", "assured:", "pilot:", "image: picture not understood")


@dataclass(frozen=True)
class Subject:
    """What flies, and which recorded ticks.

    Attributes:
        make: Makes it.
        case: Recording.
        first, ticks: Its ticks that are flown.
        agreed: Largest difference from an undisturbed flight half a second after hostile inputs that are refused [N];
            None with a supervisor, which stays in a retreat that it began.
        bare: Fly without accelerometer: no observer of forces remembers thrusts that the recorded vehicle did not feel.
    """

    make: Callable[[], Any]
    case: str
    first: int
    ticks: int = 700
    agreed: float | None = None
    bare: bool = False

    @functools.cached_property
    def pilot(self) -> bool:
        """Whether it takes sensor frames."""
        return hasattr(built(self), "thrust_limits")

    def good(self, tick: int) -> tuple[Any, ...]:
        """Recorded arguments of a step; nothing can be written into them."""
        flight, tick = recording(self.case), self.first + tick
        inputs = (flight.frames[tick],) if self.pilot else (flight.measurements[tick], flight.references[tick])
        if self.bare:
            inputs = (dataclasses.replace(inputs[0], specific_force=None), *inputs[1:])
        for array in arrays_in(inputs):
            array.flags.writeable = False
        return inputs


@functools.cache
def built(subject: Subject) -> Any:
    """Construction costs far more than `reset`."""
    return subject.make()


@functools.cache
def undisturbed(subject: Subject) -> list[tuple[np.ndarray, tuple[str, ...]]]:
    """Thrusts and rejections of the flight without a hostile input: the twin of every disturbed one."""
    flown = built(subject)
    flown.reset()
    commands = [flown.step(*subject.good(tick)) for tick in range(subject.ticks)]
    return [(command.thrusts, command.rejected) for command in commands]


def shifted(value: Any, shift_ns: int) -> Any:
    """An input with all its stamps that are times shifted."""
    changes = {
        field.name: getattr(value, field.name) + shift_ns
        for field in dataclasses.fields(value)
        if field.name.endswith("stamp_ns") and getattr(value, field.name)
    }
    if getattr(value, "features", None) is not None:
        changes["features"] = shifted(value.features, shift_ns)
    if getattr(value, "lines", ()):
        changes["lines"] = tuple([shifted(line, shift_ns) for line in value.lines])
    return dataclasses.replace(value, **changes)


def refused(rejected: tuple[str, ...]) -> list[str]:
    """Rejections of inputs: a push that is reduced to the reach follows from estimates."""
    return [text for text in rejected if not text.startswith("reference.push_force: ")]


class Violation(AssertionError):
    """An invariant that a step broke, with the inputs of that step."""


class Flight:
    """One flight from its reset.

    Attributes:
        tick: Recorded ticks so far.
        calls, hostile_calls: Steps so far, and those of them with hostile inputs.
    """

    def __init__(self, subject: Subject, mutator: Mutator, flown: Any = None) -> None:
        self.subject, self.mutator, self.flown = subject, mutator, flown or built(subject)
        setpoints = controller_of(self.flown).setpoints
        vehicle = setpoints.config.vehicle
        self._box = np.array(vehicle.thrust_min), np.array(vehicle.thrust_max)
        self._rate_step = vehicle.thrust_rate_n_s * setpoints.config.tick_s + ROUNDING
        self._twin = undisturbed(subject)
        self.calls = self.hostile_calls = 0
        self.restart()

    def restart(self) -> None:
        """From the first tick, as after construction."""
        self.flown.reset()
        self.tick, self.disturbed, self._last, self._lap_ns = 0, False, None, 0

    def rewind(self) -> None:
        """From the first tick, under a clock that goes on."""
        first, last = (self.subject.good(tick)[0].stamp_ns for tick in (0, self.tick - 1))
        self._lap_ns += last - first + LAP_STEP
        self.tick, self.disturbed = 0, True

    def recorded(self) -> tuple[Any, ...]:
        """Good inputs of the tick, under the clock of the flight."""
        inputs = self.subject.good(self.tick)
        return (shifted(inputs[0], self._lap_ns), *inputs[1:]) if self._lap_ns else inputs

    @property
    def lied(self) -> bool:
        """Whether the flight may remember a believable wrong value, or a supervisor what it did about others."""
        return self.disturbed and (self.mutator.lies or self.subject.agreed is None)

    @property
    def left(self) -> int:
        """Recorded ticks left."""
        return self.subject.ticks - self.tick

    def good(self, ticks: int = 1, reused: bool = False) -> Command:
        """Recorded ticks; ``reused``: the caller writes into its arrays afterwards."""
        for _ in range(min(ticks, self.left)):
            inputs = self.recorded()
            command = self.step(copy.deepcopy(inputs) if reused else inputs, spoil=reused)
            if not self.disturbed and not np.array_equal(command.thrusts, self._twin[self.tick][0]):
                raise Violation(f"tick {self.tick}: good inputs, other thrusts; arrays reused: {reused}")
            self.tick += 1
        return command

    def hostile(self) -> Command:
        """A recorded tick with hostile inputs."""
        command = self.step(self.hostile_inputs(), spoil=True)
        self.tick, self.disturbed, self.hostile_calls = self.tick + 1, True, self.hostile_calls + 1
        return command

    def hostile_inputs(self) -> tuple[Any, ...]:
        """Of a tick: one or two of the arguments, and of a controller its third one, are hostile."""
        inputs, mutator = list(self.recorded()), self.mutator
        place = mutator.random.randrange(10)
        if self.subject.pilot:
            inputs[0] = mutator.mutate(inputs[0])
        elif place < 6:
            inputs[0] = mutator.mutate(inputs[0])
        elif place < 8:
            inputs[1] = mutator.mutate(inputs[1])
        elif place < 9:
            inputs = [mutator.mutate(value) for value in inputs]
        else:
            inputs.append(mutator.mutate(controller_of(self.flown).setpoints.contact))
        return tuple(inputs)

    def agrees(self, ticks: int = RECOVERY) -> float:
        """Largest difference from the undisturbed flight after so many good ticks [N]: small, and nothing rejected."""
        command = self.good(ticks)
        thrusts, rejected = self._twin[self.tick - 1]
        if refused(rejected) != refused(command.rejected):
            raise Violation(f"tick {self.tick}: rejected {command.rejected}, undisturbed {rejected}")
        difference = float(np.abs(command.thrusts - thrusts).max())
        if self.subject.agreed is not None and difference > self.subject.agreed:
            raise Violation(
                f"tick {self.tick}: {difference:.2f} N from the undisturbed flight after {ticks} good ticks"
            )
        return difference

    def step(self, inputs: tuple[Any, ...], spoil: bool = False) -> Command:
        """One step with all invariants checked; what the caller may write into afterwards is written into."""
        try:
            command = self.flown.step(*inputs)
            self.calls += 1
            self._check(command, inputs)
        except Exception as error:
            raise Violation(
                f"tick {self.tick}: {type(error).__name__}: {error}\ngiven: {self.shown(inputs)}"
            ) from error
        self._last = command.thrusts.copy()
        kept = Command(**{**vars(command), "thrusts": self._last})
        for array in (command.thrusts, command.wrench, command.unallocated_wrench):
            array[:] = np.nan
        if spoil:
            _spoil(inputs)
        return kept

    def shown(self, inputs: tuple[Any, ...]) -> str:
        """How inputs of this tick differ from the recorded ones."""
        return "; ".join(shown(*pair) for pair in itertools.zip_longest(inputs, self.subject.good(self.tick)))

    def _check(self, command: Command, inputs: tuple[Any, ...]) -> None:
        thrusts, (low, high) = command.thrusts, self._box
        assert type(command) is Command and type(thrusts) is np.ndarray and thrusts.shape == low.shape, command
        assert np.isfinite(thrusts).all() and (thrusts >= low).all() and (thrusts <= high).all(), thrusts
        if self._last is not None:
            change = np.abs(thrusts - self._last).max()
            assert change <= self._rate_step, f"changed by {change} N"
        for wrench in (command.wrench, command.unallocated_wrench):
            assert wrench.shape == (6,) and np.isfinite(wrench).all(), wrench
        assert isinstance(command.outcome, Outcome) and command.mode in ("free", "approach", "contact", "hold")
        assert isinstance(command.safety, SafetyState) and (command.safety_reasons == ()) == (
            command.safety is SafetyState.NOMINAL
        )
        stamp = getattr(inputs[0], "stamp_ns", None) if type(inputs[0]) in unusable.INPUTS else None
        assert command.stamp_ns == (stamp if unusable.is_stamp(stamp) else 0) and type(command.stamp_ns) is int
        assert type(command.rejected) is tuple
        for reason in (*command.rejected, *command.safety_reasons):
            assert isinstance(reason, str) and not reason.startswith(RAISED), reason
        if self.calls % 50 == 0:
            assert all(np.isfinite(row.achieved) for row in command.tasks)
        for name in self._unusable(command, inputs):
            assert any(reason.startswith(name) for reason in command.rejected), f"{name} not in {command.rejected}"

    def _unusable(self, command: Command, inputs: tuple[Any, ...]) -> Iterator[str]:
        """Names that must be rejected; without a measurement there is nothing to say about its fields."""
        refused = command.rejected
        if self.subject.pilot:
            if not any(reason.startswith("sensor frame") for reason in refused):
                untimely = tuple(name for name in ("image", "features") if f"sensor {name}" in " ".join(refused))
                yield from (name for name in unusable.in_frame(inputs[0]) if not name.startswith(untimely))
            return
        measurement, reference, *contact = inputs
        if not any(reason.startswith(("measurement", "stamp_ns")) for reason in refused):
            yield from unusable.in_measurement(measurement)
        elif isinstance(measurement, unusable.Measurement) and not unusable.is_stamp(measurement.stamp_ns):
            yield "stamp_ns"
        yield from unusable.in_reference(reference)
        for value in contact:
            yield from unusable.in_contact(value)


def _spoil(value: Any, depth: int = 0) -> None:
    """Write into every array and list that can be written."""
    if isinstance(value, np.ndarray) and value.flags.writeable and value.dtype.kind in "fiu":
        value[...] = np.nan if value.dtype.kind == "f" else 99
    elif dataclasses.is_dataclass(value) and not isinstance(value, type):
        for field in dataclasses.fields(value):
            _spoil(getattr(value, field.name), depth + 1)
    elif type(value) in (list, tuple) and depth < 6 and len(value) < 20:
        for entry in value:
            _spoil(entry, depth + 1)


def controller_of(flown: Any) -> Any:
    """The controller inside."""
    return getattr(flown, "controller", flown)


def shown(value: Any, good: Any = None, depth: int = 0) -> str:
    """Inputs in words, whatever they are; of a changed copy of good ones only what differs."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        entries = [(field.name, getattr(value, field.name)) for field in dataclasses.fields(value)]
        entries = [(name, entry, getattr(good, name, None)) for name, entry in entries]
        inside = [f"{name}={shown(entry, old, depth + 1)}" for name, entry, old in entries if entry is not old]
        return f"{type(value).__name__}({', '.join(inside)})"
    if isinstance(value, list | tuple) and depth < 8:
        old = good if type(good) is tuple and len(good) == len(value) else (None,) * len(value)
        inside = [shown(entry, before, depth + 1) for entry, before in list(zip(value, old, strict=True))[:9]]
        return f"{type(value).__name__} of {len(value)}: [{', '.join(inside)}]"
    if isinstance(value, np.ndarray) and value.dtype.kind != "O" and value.size <= 40:
        return f"{type(value).__name__}({value.tolist()}, {value.dtype})"
    try:
        return repr(value)[:200] if not isinstance(value, int) or abs(value) < 2**200 else "a giant integer"
    except Exception:
        return f"a {type(value).__name__}"
