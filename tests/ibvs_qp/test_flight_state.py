"""A restored snapshot continues bit-identically: in another object, in another process, and as often as wanted."""

from __future__ import annotations

import copy
import dataclasses
import functools
import multiprocessing
import pickle
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from recorded_inputs import recording
from references import good_reference
from sensed_vehicle import SensedVehicle
from small_vehicle import SmallVehicle

from ibvs_qp import Assured, Command, HybridController, PaperController, Pilot, SafetySettings, SafetyState
from ibvs_qp.config import ControllerConfig
from ibvs_qp.config.errors import ConfigError
from ibvs_qp.flight_state import FlightState
from ibvs_qp.model.model import Model
from ibvs_qp.model.rows import Parameter, TaskRow
from ibvs_qp.pilot.painting.command import PainterInput, PaintingCommand
from ibvs_qp.pilot.painting.strategy import Strategy
from ibvs_qp.tasks import Task
from tests.replay.cases import CASES


class OwnRow(Task):
    """A row of a user's: the first thrust stays near a target that may change."""

    def __init__(self) -> None:
        self._target = Parameter("own_thrust", 12.0)

    def rows(self, model: Model) -> list[TaskRow]:
        target = model.parameter(self._target)
        return [TaskRow(name="own", unit="N", expression=model.thrust[0], target=target, weight=0.1)]


#: Ticks for which a copy is compared.
TICKS = 300


def numbers(command: Command) -> tuple[Any, ...]:
    """What must be equal bit by bit."""
    arrays = command.thrusts, command.wrench, command.unallocated_wrench
    words = command.outcome, command.mode, command.rejected, command.safety, command.safety_reasons
    return *(array.tobytes() for array in arrays), *words, repr(command.reach_margin), command.iterations


def continues(
    flown: Any, other: Any, step: Callable[[Any, int], Command], snapshots: list[int], ticks: int = TICKS
) -> list[FlightState]:
    """Fly through all ticks with snapshots; from each of them the other one continues as the first did."""
    states, commands = [], []
    for tick in range(max(snapshots) + ticks):
        if tick in snapshots:
            states.append(flown.state())
        commands.append(numbers(step(flown, tick)))
    for begin, state in zip(snapshots, states, strict=True):
        other.restore(pickle.loads(pickle.dumps(state)))
        for tick in range(begin, begin + ticks):
            if tick in snapshots and tick > begin:
                other.state()  # the solver sets up anew, as in the first one
            assert numbers(step(other, tick)) == commands[tick], f"from {begin}, at {tick}"
    return states


def replayed(case: str) -> Callable[[Any, int], Command]:
    """Step of a recorded flight."""
    flight = recording(case)

    def step(flown: Any, tick: int) -> Command:
        if not isinstance(flown, Pilot):
            return flown.step(flight.measurements[tick], flight.references[tick])
        flown.thrust_limits = flight.thrust_limits[tick]
        return flown.step(flight.frames[tick])

    return step


@pytest.mark.slow
@pytest.mark.parametrize(
    ("case", "snapshots"),
    [
        ("rotor_loss", [0, 1, 400, 1000, 1300]),  # in contact, at an active limit; without a rotor
        ("heavy_noise", [300, 1700, 2300]),
        ("paint_paper_law", [200, 1300, 1650]),
    ],
)
def test_a_recorded_flight_continues_from_every_snapshot(case: str, snapshots: list[int]) -> None:
    pilots = [CASES[case].pilot() for _ in range(2)]
    continues(*pilots, replayed(case), snapshots)


@pytest.mark.parametrize("case", ["paint_qp", "paper_vision"])
def test_a_flight_with_pictures_continues_in_a_pilot_that_has_loaded_nothing(case: str) -> None:
    continues(CASES[case].pilot(), Pilot(CASES[case].config()), replayed(case), [110, 160], ticks=60)


def test_a_flight_without_perception_continues_where_it_is_loaded() -> None:
    pilot, other = Pilot(CASES["paint_qp"].config()), CASES["paint_qp"].pilot()
    frames = [dataclasses.replace(frame, image=None) for frame in recording("paint_qp").frames[:100]]
    continues(pilot, other, lambda flown, tick: flown.step(frames[tick]), [60], ticks=40)


@pytest.mark.parametrize("law", [HybridController, PaperController, "compiled"])
def test_a_controller_of_a_loop_of_ones_own_continues(law: Any) -> None:
    config = CASES["rotor_loss"].config().controller
    kind, config = (HybridController, config.on_backend("compiled")) if law == "compiled" else (law, config)
    continues(kind(config), kind(config), replayed("rotor_loss"), [0, 300, 900, 1250])


class FaultyFlight:
    """A small vehicle whose force sensor, and then attitude, fail; it flies the commands of its own copy."""

    FAULT = 120

    def __init__(self, flown: Pilot | Assured) -> None:
        self.vehicle = SensedVehicle(0.3) if isinstance(flown, Pilot) else SmallVehicle(ControllerConfig(), 0.3)
        self.inputs: list[tuple[Any, ...]] = []

    def step(self, flown: Any, tick: int) -> Command:
        """Record the inputs at the first call of a tick, which are those of every copy."""
        if tick < len(self.inputs):
            return flown.step(*self.inputs[tick])
        broken = {"wrench_stamp_ns": 1} if tick >= self.FAULT else {}
        broken |= {"attitude": np.full(4, np.nan)} if tick >= 2 * self.FAULT else {}
        if isinstance(flown, Pilot):
            assert isinstance(self.vehicle, SensedVehicle)
            self.inputs.append((self.vehicle.sense(**broken),))
        else:
            self.inputs.append((self.vehicle.measure(**broken), good_reference()))
        command = flown.step(*self.inputs[tick])
        self.vehicle.fly(command.thrusts)
        return command


@pytest.mark.slow
@pytest.mark.parametrize("make", [Pilot, lambda: Assured(HybridController())])
def test_a_supervised_fault_continues(make: Callable[[], Any]) -> None:
    flown, other = make(), make()
    flight, begin = FaultyFlight(flown), FaultyFlight.FAULT
    states = continues(flown, other, flight.step, [begin - 20, begin + 15, begin + 40, 2 * begin + 20], ticks=120)
    seen = []
    for state in states:
        other.restore(state)
        seen.append(other.supervision.state)
    assert seen[0] is SafetyState.NOMINAL and SafetyState.RETREAT in seen[1:]


def test_one_snapshot_serves_many_branches() -> None:
    """Neither a flight that goes on nor a copy changes it."""
    step, pilot = replayed("rotor_loss"), CASES["rotor_loss"].pilot()
    for tick in range(500):
        step(pilot, tick)
    state = pilot.state()
    branches = []
    for _ in range(3):
        pilot.restore(state)
        branches.append([numbers(step(pilot, tick)) for tick in range(500, 600)])
    assert branches[0] == branches[1] == branches[2]


def continued(config: Any, state: FlightState, begin: int, ticks: int) -> list[tuple[Any, ...]]:
    """In a child process: the commands of a new pilot from a state."""
    pilot, step = Pilot(config), replayed("paint_paper_law")
    pilot.restore(state)
    return [numbers(step(pilot, tick)) for tick in range(begin, begin + ticks)]


@pytest.mark.slow
def test_a_child_process_continues() -> None:
    config, step = CASES["paint_paper_law"].config(), replayed("paint_paper_law")
    pilot = Pilot(config)
    for tick in range(1200):
        step(pilot, tick)
    state = pilot.state()
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        found = pool.apply(continued, (config, state, 1200, 100))
    assert found == [numbers(step(pilot, tick)) for tick in range(1200, 1300)]


class Zigzag(Strategy):
    """A strategy of a user's, with state of its own and a function that is none."""

    def reset(self) -> None:
        super().reset()
        self.turns, self.rng, self.on_turn = 0, np.random.default_rng(1), lambda: None

    def step(self, inputs: PainterInput) -> PaintingCommand:
        self.turns += inputs.push_reference >= 0.0
        velocity = np.array((0.05 if self.turns // 50 % 2 else -0.05, 0.0)) * self.rng.uniform(0.5, 1.0)
        return PaintingCommand(contact=False, standoff=0.2, velocity=velocity)


def test_the_state_of_a_strategy_of_ones_own_is_its_attributes() -> None:
    config = CASES["rotor_loss"].config()
    pilots = [Pilot(config, Zigzag(config.painting)) for _ in range(2)]
    continues(*pilots, replayed("rotor_loss"), [70, 130], ticks=100)


@functools.cache
def some_state() -> FlightState:
    return Pilot().state()


def refused() -> Iterator[tuple[str, Any, Any, str]]:
    config = Pilot().config
    supervised = dataclasses.replace(config, safety=SafetySettings(supervise=False))
    yield "nothing", Pilot(), None, "state: NoneType, not a FlightState"
    yield "class", HybridController(), some_state(), "state: of a Pilot, not of a HybridController"
    yield "configuration", Pilot(supervised), some_state(), "another configuration"
    yield "strategy", Pilot(painter=Zigzag(config.painting)), some_state(), "another configuration, strategy"
    yield "law", Pilot(controller=PaperController()), some_state(), "another configuration, strategy, tasks"


def test_what_cannot_continue_is_refused_and_changes_nothing() -> None:
    for name, flown, state, words in refused():
        before = pickle.dumps(flown.state().values["" if isinstance(flown, Pilot) else "gate"])
        with pytest.raises(ConfigError, match=words):
            flown.restore(state)
        assert pickle.dumps(flown.state().values["" if isinstance(flown, Pilot) else "gate"]) == before, name


@pytest.mark.parametrize("copy_of", [copy.copy, copy.deepcopy, lambda flown: pickle.loads(pickle.dumps(flown))])
@pytest.mark.parametrize("kind", ["program", "analytic", "own row", "assured", "pilot"])
def test_copies_and_pickles_continue(kind: str, copy_of: Callable[[Any], Any]) -> None:
    """As for a process that is spawned: from its construction and in flight."""
    config = CASES["rotor_loss"].config()
    make: dict[str, Callable[[], Any]] = {
        "program": lambda: HybridController(config.controller),
        "analytic": lambda: PaperController(config.controller),
        "own row": lambda: HybridController(config.controller, tasks=(OwnRow(),)),
        "assured": lambda: Assured(HybridController(config.controller), SafetySettings(imu_age_s=0.05)),
        "pilot": lambda: Pilot(config),
    }
    flown, step = make[kind](), replayed("rotor_loss")
    for tick in range(40):
        if tick in (0, 20):
            other = copy_of(flown)
        assert numbers(step(other, tick)) == numbers(step(flown, tick)), tick


class OwnConstructor(HybridController):
    """A law of a user's whose constructor has other arguments."""

    def __init__(self, gain: float, *, config: ControllerConfig) -> None:
        super().__init__(config)
        self.gain = gain


class OwnPilot(Pilot):
    """A pilot of a user's with a name."""

    def __init__(self, name: str) -> None:
        super().__init__()
        self.name = name


def test_a_subclass_with_its_own_constructor_is_copied() -> None:
    assert [each.name for each in (copy.copy(OwnPilot("one")), copy.deepcopy(OwnPilot("one")))] == ["one", "one"]
    config = CASES["rotor_loss"].config().controller
    flown = OwnConstructor(0.5, config=config)
    for other in (copy.deepcopy(flown), pickle.loads(pickle.dumps(flown))):
        assert type(other) is OwnConstructor and other.gain == 0.5 and other.config == config
