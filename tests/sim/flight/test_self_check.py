"""The self-check in flight: wrong axes are named in the commands, and right ones pass in every world."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
import pytest

from ibvs_qp.config import SafetySettings
from ibvs_qp.measurement import SensorFrame
from ibvs_qp.pilot import Pilot
from sim.experiments.scenes import near_wall
from sim.flight.closed_loop import fly
from sim.flight.options import FlightOptions, pilot_config
from sim.flight.surroundings import World
from sim.world.errors import world_errors

FLU = np.array([1.0, -1.0, -1.0])
OPTIONS = FlightOptions(features="geometric", video=False, compiled=True)


def found(ticks: int, seen_as: Callable[[SensorFrame], SensorFrame], enabled: bool = True) -> tuple[Pilot, list[str]]:
    """Fly until something is named."""
    scene = near_wall()
    config = pilot_config(scene, OPTIONS)
    config = dataclasses.replace(config, safety=SafetySettings(self_check=enabled))
    pilot, world = Pilot(config), World(scene, OPTIONS, config)
    for _ in range(ticks):
        command = pilot.step(seen_as(world.sense()))
        world.act(command.thrusts)
        if names := [reason for reason in command.rejected if reason.startswith("self-check: ")]:
            break
    return pilot, names


def of_imu(frame: SensorFrame) -> SensorFrame:
    both = {name: FLU * getattr(frame, name) for name in ("specific_force", "angular_velocity")}
    return dataclasses.replace(frame, **both)


def of_attitude(frame: SensorFrame) -> SensorFrame:
    """FLU in NED: turned by half a turn about the front."""
    w, x, y, z = frame.attitude
    return dataclasses.replace(frame, attitude=np.array([-x, w, z, -y]))


def of_wrench(order: list[int], sign: float = 1.0) -> Callable[[SensorFrame], SensorFrame]:
    return lambda frame: dataclasses.replace(frame, wrench=sign * frame.wrench[[*order, *(3 + axis for axis in order)]])


@pytest.mark.parametrize(
    ("seen_as", "words"),
    [
        (of_imu, "self-check: specific_force: "),
        (of_attitude, "self-check: attitude: "),
    ],
)
def test_wrong_inertial_axes_are_named_at_once(seen_as: Callable[[SensorFrame], SensorFrame], words: str) -> None:
    pilot, names = found(20, seen_as)
    assert len(names) == 1 and names[0].startswith(words) and not pilot.self_check.passed


AXES = [([0, 1, 2], -1.0), ([1, 0, 2], 1.0), ([2, 1, 0], 1.0), ([1, 2, 0], 1.0)]


def zeroed(seen_as: Callable[[SensorFrame], SensorFrame]) -> Callable[[SensorFrame], SensorFrame]:
    """The same from a sensor whose driver takes its reading at rest for zero."""
    rest = np.array([0.0, 0.0, -3.43, 0.0, 0.86, 0.0])
    return lambda frame: seen_as(dataclasses.replace(frame, wrench=frame.wrench - rest))


@pytest.mark.parametrize(("order", "sign"), AXES)
def test_a_force_sensor_in_wrong_axes_is_named_before_the_tare(order: list[int], sign: float) -> None:
    pilot, names = found(2500, of_wrench(order, sign))
    assert len(names) == 1 and names[0].startswith("self-check: force sensor: turned by ")
    assert not pilot.estimator.tared and not pilot.self_check.passed


@pytest.mark.slow
@pytest.mark.parametrize(("order", "sign"), AXES)
def test_a_zeroed_force_sensor_in_wrong_axes_is_named_at_the_first_touch(order: list[int], sign: float) -> None:
    pilot, names = found(2500, zeroed(of_wrench(order, sign)))
    assert [text for _, kind, text in pilot.painter.log if kind == "force sensor" and "zeroed by its driver" in text]
    assert len(names) == 1 and names[0].startswith("self-check: wrench: the first touch is (")
    assert pilot.contact.state.distance > -0.006, "before it presses with more than 9 N"
    assert not pilot.self_check.passed


def test_switched_off_it_names_nothing() -> None:
    assert found(50, of_imu, enabled=False)[1] == []


@pytest.mark.slow
@pytest.mark.parametrize("law", ["qp", "paper"])
@pytest.mark.parametrize("world", ["ideal", "datasheet", "harsh"])
def test_right_axes_pass_in_every_world(world: str, law: str) -> None:
    scene = dataclasses.replace(near_wall(), errors=world_errors(world))
    options = dataclasses.replace(OPTIONS, law=law, seed=1)
    config = pilot_config(scene, options)
    pilot, flown = Pilot(config), World(scene, options, config)
    for tick in range(7000):  # a survey of stroke 1 comes first where its begin is not in view
        command = pilot.step(flown.sense())
        flown.act(command.thrusts)
        assert not any(reason.startswith("self-check") for reason in command.rejected)
        assert pilot.self_check.passed == (tick >= 12)
        if pilot.contact.state.time_since_touch > 1.0:
            return
    raise AssertionError("no contact")


@pytest.mark.parametrize("law", ["qp", "paper"])
def test_a_turned_force_sensor_ends_the_job_by_name_before_the_touch(law: str) -> None:
    scene = near_wall(plant={"force_torque_turn_deg": (90.0, 0.0, 0.0)}, errors=vars(world_errors("datasheet")))
    trace = fly(scene, dataclasses.replace(OPTIONS, law=law))
    assert not trace.claimed and trace.push_true.max() == 0.0
    assert trace.reason.startswith("sensor data in other axes: force sensor: turned by ")
    assert " deg about x against the vehicle's settings" in trace.reason


@pytest.mark.slow
@pytest.mark.parametrize("world", ["datasheet", "harsh"])
def test_the_load_of_a_right_sensor_is_no_turn_in_20_flights(world: str) -> None:
    scene = dataclasses.replace(near_wall(), errors=world_errors(world))
    config = pilot_config(scene, OPTIONS)
    pilot = Pilot(config)
    for seed in range(20):
        pilot.reset()
        flown = World(scene, dataclasses.replace(OPTIONS, seed=seed), config)
        while not pilot.estimator.tared:
            command = pilot.step(flown.sense())
            flown.act(command.thrusts)
        flown.close()
        assert not pilot.self_check.faults() and not pilot.self_check.note
