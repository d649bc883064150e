"""Turn of the force sensor by the tool's weight and moment at rest: found, hidden by an offset, or not checkable."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ibvs_qp.config import SafetySettings
from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.frames import GRAVITY
from ibvs_qp.validation.load_check import LoadCheck, checkable_turns, smallest_turns_deg

DT = 0.004
VEHICLE, SETTINGS = VehicleParams(), SafetySettings()
REST = np.array([0.0, 0.0, -GRAVITY])
ZEROED = -np.array([0.0, 0.0, -0.35 * GRAVITY, 0.0, 0.25 * 0.35 * GRAVITY, 0.0])


def checked(
    turn_deg: tuple[float, float, float] = (0.0, 0.0, 0.0),
    offset: tuple[float, ...] | np.ndarray = (0.0,) * 6,
    vehicle: VehicleParams = VEHICLE,
    acceleration: tuple[float, float, float] = (0.0, 0.0, 0.0),
    free: bool = True,
    sigma_n: float = 0.3,
    seconds: float = 0.5,
    seed: int = 0,
) -> LoadCheck:
    """Half a second of noisy readings at 100 Hz of a sensor that is turned by a rotation vector."""
    check, rng = LoadCheck(vehicle, SETTINGS), np.random.default_rng(seed)
    specific = REST + acceleration
    force = vehicle.tool_mass_kg * specific
    moment = np.cross(np.subtract(vehicle.tool_position_m, vehicle.force_torque_position_m), force)
    to_sensor = Rotation.from_rotvec(turn_deg, degrees=True).inv()
    load = np.concatenate((to_sensor.apply(force), to_sensor.apply(moment))) + offset
    reading, stamp = load, -1
    for tick in range(round(seconds / DT)):
        if tick * DT % 0.01 < DT:
            stamp = round(1e9 * tick * DT)
            reading = load + np.concatenate((rng.normal(0.0, sigma_n, 3), rng.normal(0.0, 0.02, 3)))
        check.add(reading, stamp, (specific + rng.normal(0.0, 0.3, 3)).tolist(), free, DT)
    return check


@pytest.mark.parametrize(
    ("turn_deg", "words"),
    [
        ((90.0, 0.0, 0.0), " deg about x "),
        ((-10.0, 0.0, 0.0), "turned by -"),
        ((0.0, 30.0, 0.0), " deg about y "),
        ((0.0, 0.0, 10.0), " deg about z "),
        ((0.0, 0.0, 180.0), " deg about z "),
        ((60.0, 60.0, 0.0), " deg about (0.7, 0.7, "),
    ],
)
def test_a_turned_sensor_is_named_with_its_turn(turn_deg: tuple[float, float, float], words: str) -> None:
    check = checked(turn_deg)
    (fault,) = check.faults
    assert fault.startswith("force sensor: turned by ") and words in fault and "against the vehicle's settings" in fault
    degrees = float(fault.split("turned by ")[1].split(" deg")[0])
    assert abs(degrees) == pytest.approx(math.hypot(*turn_deg), abs=2.0)


@pytest.mark.parametrize(("turn_deg", "found"), [(4.5, False), (10.0, True)])
@pytest.mark.parametrize("axis", range(3))
def test_a_heavy_tool_makes_no_turn_of_cross_talk(axis: int, turn_deg: float, found: bool) -> None:
    """Beside 12 N of weight and 3 N m of moment the zero offset hides 4 deg only."""
    heavy = dataclasses.replace(VEHICLE, tool_mass_kg=1.2)
    turn = [0.0, 0.0, 0.0]
    turn[axis] = turn_deg
    assert bool(checked((turn[0], turn[1], turn[2]), vehicle=heavy).faults) == found


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_zero_offset_of_the_force_is_no_turn_and_hides_none_beyond_the_stated_angle(axis: int, sign: float) -> None:
    offset = np.zeros(6)
    offset[axis] = 0.8 * sign
    assert checked(offset=offset).faults == ()
    for name, degrees in smallest_turns_deg(VEHICLE, SETTINGS).items():
        turn = dict.fromkeys("xyz", 0.0) | {name: degrees + 1.0}
        assert checked((turn["x"], turn["y"], turn["z"]), offset).faults


def test_a_sensor_zeroed_by_its_driver_is_named_and_not_refused() -> None:
    for turn_deg in ((0.0, 0.0, 0.0), (90.0, 0.0, 0.0)):
        load = Rotation.from_rotvec(turn_deg, degrees=True).inv()
        zeroed = np.concatenate((load.apply(ZEROED[:3]), load.apply(ZEROED[3:])))
        check = checked(turn_deg, offset=zeroed)
        assert check.faults == () and check.done
        assert "the tool weighs 3.4 N: zeroed by its driver, a turn is not checkable" in check.note


def test_the_moment_shows_a_turn_that_a_large_offset_of_the_force_hides() -> None:
    offset = (7.0, -6.0, 4.0, 0.0, 0.0, 0.0)
    straight, turned = checked(offset=offset), checked((0.0, 0.0, 20.0), offset)
    assert straight.faults == () and "a zero offset, or another tool" in straight.note
    assert "turned by 20 deg about z" in turned.faults[0]


def test_an_acceleration_moves_the_load_and_is_no_turn() -> None:
    assert checked(acceleration=(1.0, -1.0, 0.3)).faults == ()
    assert checked((90.0, 0.0, 0.0), acceleration=(1.0, -1.0, 0.3)).faults


def test_noise_is_averaged_for_longer_and_is_no_turn() -> None:
    for seed in range(20):
        short = checked(sigma_n=3.0, seed=seed)
        assert not short.done and short.faults == ()
        long = checked(sigma_n=3.0, seconds=3.1, seed=seed)
        assert long.done and long.faults == () and long.note == ""
    assert checked((60.0, 0.0, 0.0), sigma_n=3.0, seconds=3.1).faults


def test_readings_near_the_wall_are_not_compared() -> None:
    check = checked((90.0, 0.0, 0.0), free=False)
    assert not check.done and check.faults == ()


def test_what_the_tool_cannot_show_is_stated() -> None:
    ahead = checkable_turns(VEHICLE, SETTINGS)
    assert ahead == (
        "force sensor: turns from 10 deg about x, 29 deg about y, 10 deg about z are found at rest by the tool's "
        "weight and moment"
    )
    below = dataclasses.replace(VEHICLE, tool_position_m=(0.25, 0.0, 0.3))
    assert "a turn about z is not checkable at rest, only by the first push" in checkable_turns(below, SETTINGS)
    assert checked((0.0, 0.0, 90.0), vehicle=below).faults == ()
    assert "turned by " in checked((90.0, 0.0, 0.0), vehicle=below).faults[0]
    light = dataclasses.replace(VEHICLE, tool_mass_kg=0.0)
    assert checkable_turns(light, SETTINGS) == (
        "force sensor: a turn about x or y or z is not checkable at rest, only by the first push"
    )
    assert checked((90.0, 0.0, 0.0), vehicle=light).faults == ()
    better = dataclasses.replace(SETTINGS, force_offset_n=0.25)
    assert smallest_turns_deg(VEHICLE, better)["y"] == pytest.approx(10.0)
