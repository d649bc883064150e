"""A strategy with one method flies: faults of `step` are named, and the vehicle leaves the wall."""

from __future__ import annotations

import dataclasses
import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from sensed_vehicle import SensedVehicle

from ibvs_qp import ConfigError, PainterInput, PaintingCommand, Pilot, PilotConfig, SafetyState, Strategy
from ibvs_qp.pilot.painting.config import PaintingConfig
from ibvs_qp.pilot.painting.strategy import require_strategy

FREE = PaintingCommand(contact=False, standoff=0.1)
LINE: Any = SimpleNamespace(track_id=1)


def inputs(time_s: float = 1.0, **changes: Any) -> PainterInput:
    """Estimates of a tip on the wall."""
    values: dict[str, Any] = {
        "time_s": time_s, "lines": {1: LINE}, "odometer": (0.0, 0.0), "velocity": (0.0, 0.0), "distance": 0.0,
        "wall_known": True, "in_contact": True, "time_since_touch": 1.0, "push": 5.0, "push_reference": 5.0,
        "tared": True,
    }  # fmt: skip
    return PainterInput(**(values | changes))


class Fixed(Strategy):
    """Returns what it is given; an exception is raised."""

    answer: Any = FREE

    def step(self, inputs: PainterInput) -> PaintingCommand:
        """What the test says."""
        if isinstance(self.answer, Exception):
            raise self.answer
        return self.answer


def of(answer: Any) -> Fixed:
    strategy = Fixed()
    strategy.answer = answer
    return strategy


def test_one_method_is_enough() -> None:
    strategy = of(PaintingCommand(True, 0.02, (0.1, 0), [(LINE, 1)], 5))  # type: ignore[arg-type]
    command = strategy.fly(inputs())
    assert command.contact is True and command.push == 5.0 and command.guides == [(LINE, 1)]
    np.testing.assert_array_equal(command.velocity, (0.1, 0.0))
    assert (strategy.phase, strategy.row, strategy.log, strategy.reason) == ("start", 0, [], "")
    assert not (strategy.finished or strategy.failed or strategy.descending) and strategy.expected_edge() is None
    assert of(FREE).fly(inputs()) is FREE, "what is sound passes as it is"


WRONG = {
    "nothing": (None, "step returned NoneType, not a PaintingCommand"),
    "a number": (3.0, "step returned float, not a PaintingCommand"),
    "raised": (ValueError("secret"), "strategy: ValueError in step, line "),
    "push NaN": (dataclasses.replace(FREE, push=math.nan), "push: not within [0, 1000] N"),
    "pull": (dataclasses.replace(FREE, push=-1.0), "push: not within [0, 1000] N"),
    "velocity": (dataclasses.replace(FREE, velocity=np.array((math.inf, 0.0))), "velocity: not 2 finite values"),
    "shape": (dataclasses.replace(FREE, velocity=np.zeros(3)), "velocity: array of float64 with shape (3,)"),
    "stand-off": (dataclasses.replace(FREE, standoff="far"), "standoff: str, not a number"),
    "contact": (dataclasses.replace(FREE, contact=1), "contact: neither True nor False"),
    "line": (dataclasses.replace(FREE, guides=[(SimpleNamespace(track_id=1), 0.0)]), "guides: not pairs of a line"),
    "offset": (dataclasses.replace(FREE, guides=[(LINE, math.nan)]), "guides: not pairs of a line"),
    "no guides": (dataclasses.replace(FREE, guides=None), "guides: not pairs of a line"),
}


@pytest.mark.parametrize("name", WRONG)
def test_what_cannot_fly_is_named_and_the_vehicle_leaves_the_wall(name: str) -> None:
    answer, words = WRONG[name]
    strategy = of(answer)
    command = strategy.fly(inputs(1.0))
    assert words in strategy.fault and strategy.fault.startswith("strategy: ") and "secret" not in strategy.fault
    assert not command.contact and command.standoff == strategy.config.retreat_m and not command.velocity.any()
    assert strategy.phase == "retreat" and strategy.failed and not strategy.finished
    strategy.answer = FREE
    assert strategy.fly(inputs(1.5)).standoff == strategy.config.retreat_m, "it is not called again"
    strategy.fly(inputs(2.0, distance=0.34, in_contact=False))
    assert strategy.finished and strategy.phase == "done" and strategy.reason == strategy.fault
    assert [phase for _, phase, _ in strategy.log] == ["retreat", "done"]
    strategy.reset()
    assert strategy.fly(inputs()) is FREE and not strategy.fault


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [("phase", "dance", "'dance', not one of start, "), ("row", 1.5, "1.5, not a whole number"), ("log", None, "list")],
)
def test_what_others_read_stays_as_documented(name: str, value: Any, words: str) -> None:
    strategy = of(FREE)
    setattr(strategy, name, value)
    strategy.fly(inputs())
    assert words in strategy.fault and strategy.fault.startswith(f"strategy.{name}: ")
    assert strategy.phase == "retreat" and strategy.row == 0 and len(strategy.log) == 1


def test_a_strategy_leaves_when_it_is_done() -> None:
    class Brief(Strategy):
        def step(self, inputs: PainterInput) -> PaintingCommand:
            return self.leave(inputs, "seen enough")

    strategy = Brief(PaintingConfig(retreat_m=0.5))
    assert strategy.fly(inputs(0.0)).standoff == 0.5
    strategy.fly(inputs(1.0, distance=0.49, in_contact=True))
    assert not strategy.finished
    strategy.fly(inputs(2.0, distance=0.49, in_contact=False))
    assert strategy.finished and not strategy.failed and strategy.reason == "seen enough"


def test_a_retreat_that_takes_too_long_has_failed() -> None:
    strategy = of(None)
    strategy.fly(inputs(0.0))
    strategy.fly(inputs(strategy.config.timeout_s))
    assert not strategy.finished
    strategy.fly(inputs(strategy.config.timeout_s + 0.01))
    assert strategy.finished and strategy.failed and strategy.log[-1][2] == "time-out after 15 s in retreat"


def test_the_supervisor_ends_it_for_good() -> None:
    strategy = of(dataclasses.replace(FREE, contact=True))
    strategy.stop(inputs(1.0), "no picture")
    command = strategy.fly(inputs(1.0))
    assert strategy.descending and strategy.failed and not command.contact and command.velocity[1] > 0.0
    strategy.fly(inputs(1.1 + strategy.config.descend_s))
    assert strategy.finished and strategy.reason == "no picture"


class Unbuilt(Fixed):
    """Forgets its base class."""

    def __init__(self) -> None:
        pass


@pytest.mark.parametrize(
    ("strategy", "words"),
    [
        (object(), "object is no instance of ibvs_qp.Strategy"),
        (Fixed, "ABCMeta is no instance of ibvs_qp.Strategy"),
        (Unbuilt(), r"Unbuilt has no config; begin its __init__ with super\(\).__init__\(config\)"),
    ],
)
def test_a_pilot_refuses_what_is_no_strategy(strategy: Any, words: str) -> None:
    with pytest.raises(ConfigError, match=words):
        Pilot(PilotConfig(), strategy)


@pytest.mark.parametrize("legs", [3, [1.0], [(1.0, "x")], [(math.nan, 0.0)]])
def test_legs_are_pairs_of_lengths(legs: Any) -> None:
    strategy = Fixed()
    strategy.legs = legs
    with pytest.raises(ConfigError, match=r"Fixed.legs is no list of finite pairs"):
        require_strategy(strategy)


class Late(Strategy):
    """Presses and slides, and then fails."""

    def reset(self) -> None:
        """As after construction."""
        super().reset()
        self.ticks = 0

    def step(self, inputs: PainterInput) -> PaintingCommand:
        """The command, until it is late."""
        self.ticks += 1
        assert not hasattr(inputs.lines, "clear"), "lines of the filter cannot be lost"
        if self.ticks > 100:
            raise ZeroDivisionError
        return PaintingCommand(contact=True, standoff=0.02, velocity=np.array((0.05, 0.0)), push=5.0)


def test_a_pilot_flies_it_names_its_fault_in_every_command_and_retreats() -> None:
    pilot, vehicle, named = Pilot(PilotConfig(), Late()), SensedVehicle(), []
    for tick in range(1600):
        command = pilot.step(vehicle.sense())
        vehicle.fly(command.thrusts)
        named.append([text for text in command.rejected if text.startswith("strategy")])
        if tick == 90:
            assert pilot.reference.contact and pilot.reference.velocity.any() and pilot.status.phase == "start"
        if pilot.status.finished:
            break
    assert not any(named[:100]) and all(named[100:]) and "ZeroDivisionError in step, line " in named[100][0]
    assert command.safety is SafetyState.NOMINAL and not pilot.reference.contact
    assert pilot.status.finished and pilot.status.failed and pilot.status.phase == "done"
    assert vehicle.measure().contact_wrench[0] == 0.0
    assert [event.name for event in pilot.status.events][-2:] == ["retreat", "done"]


def test_a_pilot_overrules_it_when_a_sensor_is_gone() -> None:
    pilot, vehicle = Pilot(PilotConfig(), of(dataclasses.replace(FREE, contact=True, push=5.0))), SensedVehicle()
    for tick in range(120):
        frame = vehicle.sense()
        command = pilot.step(dataclasses.replace(frame, **({"wrench_stamp_ns": 1} if tick > 70 else {})))
        vehicle.fly(command.thrusts)
    assert command.safety is SafetyState.RETREAT and not pilot.reference.contact
    assert pilot.painter.failed and pilot.painter.descending and not pilot.painter.fault
