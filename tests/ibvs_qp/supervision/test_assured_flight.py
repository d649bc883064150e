"""A loop of one's own under supervision: ages by the stamps, references and thrusts replaced as in the pilot."""

from __future__ import annotations

import dataclasses
import functools
from typing import Any

import numpy as np
import pytest
from controller_scenes import FLOOR, line_references
from small_vehicle import SmallVehicle

from ibvs_qp.checked_law import Inputs
from ibvs_qp.command import Command, Outcome, SafetyState
from ibvs_qp.controller import HybridController
from ibvs_qp.measurement import Measurement, Reference
from ibvs_qp.supervision.assured import Assured

PRESS = Reference(push_force=5.0, contact=True, lines=line_references(2))
NAN = np.full(3, np.nan)


@functools.cache
def built() -> Assured:
    return Assured(HybridController())


@pytest.fixture
def assured() -> Assured:
    assured = built()
    assured.reset()
    return assured


def flown(assured: Assured, vehicle: SmallVehicle, ticks: int, **changes: Any) -> Command:
    """The last command of a flight with sensors that are changed."""
    for _ in range(ticks):
        command = assured.step(vehicle.measure(**changes), PRESS)
        vehicle.fly(command.thrusts)
    return command


def vehicle_of(assured: Assured) -> SmallVehicle:
    return SmallVehicle(assured.controller.config)


def test_a_quiet_approach_is_the_controllers_own(assured: Assured) -> None:
    vehicle, twin, alone = vehicle_of(assured), vehicle_of(assured), HybridController()
    for _ in range(60):
        command, own = assured.step(vehicle.measure(), PRESS), alone.step(twin.measure(), PRESS)
        np.testing.assert_array_equal(command.thrusts, own.thrusts)
        assert command.safety is SafetyState.NOMINAL and command.mode == "approach"
        vehicle.fly(command.thrusts)
        twin.fly(own.thrusts)


def test_a_lost_force_sensor_ends_the_press_and_is_replaced(assured: Assured, monkeypatch: pytest.MonkeyPatch) -> None:
    flown_by: list[Measurement | None] = []
    respond = assured.controller.respond

    def noted(inputs: Inputs) -> Command:
        flown_by.append(inputs.measurement)
        return respond(inputs)

    monkeypatch.setattr(assured.controller, "respond", noted)
    vehicle = vehicle_of(assured)
    flown(assured, vehicle, 20)
    command = flown(assured, vehicle, 60, contact_wrench=NAN)
    assert command.safety is SafetyState.RETREAT and command.safety_reasons[0].startswith("no force sample: ")
    assert command.mode == "free", "no approach any more"
    last = flown_by[-1]
    assert last is not None and last.wrench_stamp_ns == last.stamp_ns and not np.isnan(last.contact_wrench).any()


def test_without_an_attitude_the_thrusts_stay_and_then_end(assured: Assured) -> None:
    vehicle = vehicle_of(assured)
    flown(assured, vehicle, 20)
    held = flown(assured, vehicle, 10, attitude=np.full(4, np.nan))
    assert held.safety is SafetyState.DEGRADED and held.outcome is Outcome.HOLD
    again = flown(assured, vehicle, 1, attitude=np.full(4, np.nan))
    np.testing.assert_array_equal(again.thrusts, held.thrusts)
    ended = flown(assured, vehicle, 80, attitude=np.full(4, np.nan))
    assert ended.safety is SafetyState.TERMINATED
    np.testing.assert_allclose(ended.thrusts, FLOOR, atol=1e-6)
    back = flown(assured, vehicle, 1)
    np.testing.assert_allclose(back.thrusts, FLOOR, atol=1e-6, err_msg="the attitude is back")


def test_lines_that_stop_are_a_fault_once_there_were_some(assured: Assured) -> None:
    vehicle = vehicle_of(assured)
    assert flown(assured, vehicle, 80, lines=()).safety is SafetyState.NOMINAL
    seen = vehicle.measure()
    stamped = tuple(dataclasses.replace(line, stamp_ns=seen.stamp_ns) for line in seen.lines)
    assert flown(assured, vehicle, 40, lines=stamped).safety is SafetyState.NOMINAL
    command = flown(assured, vehicle, 20, lines=())
    assert command.safety is SafetyState.DEGRADED and command.safety_reasons[0].startswith("no picture: ")
