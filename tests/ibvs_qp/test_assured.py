"""A controller under supervision: what its caller passes never raises, and its time is the caller's."""

from __future__ import annotations

import functools
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from controller_scenes import TICK_NS
from hostile_values import Raising
from references import good_reference
from small_vehicle import SmallVehicle

from ibvs_qp.assured import Assured
from ibvs_qp.command import Command, Outcome, SafetyState
from ibvs_qp.controller import HybridController

RATE_STEP = 500.0 * 0.004


@functools.cache
def built(number: int) -> Assured:
    """Construction costs far more than `reset`."""
    return Assured(HybridController())


def flown(number: int = 0, ticks: int = 20, **changes: Any) -> tuple[Assured, SmallVehicle, Command]:
    assured = built(number)
    assured.reset()
    vehicle = SmallVehicle(assured.controller.config)
    for _ in range(ticks):
        command = assured.step(vehicle.measure(**changes), good_reference())
        vehicle.fly(command.thrusts)
    return assured, vehicle, command


@pytest.mark.parametrize("contact", [np.zeros(2), np.zeros(0), Raising(), None, 1])
def test_a_contact_flag_that_is_none_is_named_and_the_last_reference_stays_in_force(contact: Any) -> None:
    (assured, vehicle, _), (twin, other, _) = flown(), flown(1)
    command = assured.step(vehicle.measure(), replace(good_reference(), contact=contact))
    assert command.rejected == ("reference.contact: neither True nor False",)
    np.testing.assert_array_equal(command.thrusts, twin.step(other.measure(), good_reference()).thrusts)


@pytest.mark.parametrize("reference", [None, 3, replace(good_reference(), standoff=math.nan)])
def test_a_refused_reference_is_named_in_every_state(reference: Any) -> None:
    assured, vehicle, _ = flown()
    for _ in range(100):  # no force sample: degraded, then a retreat
        command = assured.step(vehicle.measure(contact_wrench=None), reference)
        vehicle.fly(command.thrusts)
        assert any(reason.startswith("reference") for reason in command.rejected)
    assert command.safety is SafetyState.RETREAT


def test_a_failing_monitor_is_named_and_the_thrusts_of_the_law_fly(monkeypatch: pytest.MonkeyPatch) -> None:
    (assured, vehicle, last), (twin, other, _) = flown(), flown(1)

    def fails(*_: Any) -> None:
        raise ZeroDivisionError

    monkeypatch.setattr(assured.assurance, "watch", fails)
    for _ in range(5):
        seen = vehicle.measure()
        command = assured.step(seen, good_reference())
        expected = twin.step(other.measure(), good_reference())
        assert command.rejected[0].startswith("assured: ZeroDivisionError in fails, line ")
        assert command.stamp_ns == seen.stamp_ns and np.abs(command.thrusts - last.thrusts).max() <= RATE_STEP + 1e-9
        np.testing.assert_array_equal(command.thrusts, expected.thrusts)
        vehicle.fly(command.thrusts)
        other.fly(command.thrusts)
        last = command


def test_a_failing_check_is_named_and_held(monkeypatch: pytest.MonkeyPatch) -> None:
    assured, vehicle, last = flown()
    monkeypatch.setattr(assured.controller.gate, "check", lambda _: 1 / 0)
    command = assured.step(vehicle.measure(), good_reference())
    assert command.outcome is Outcome.HOLD and command.rejected[0].startswith("assured: ZeroDivisionError")
    assert np.abs(command.thrusts - last.thrusts).max() <= RATE_STEP + 1e-9


def test_a_command_bears_the_stamp_of_its_measurement_after_a_leap_of_the_clock() -> None:
    """Also where the supervisor replaces the law: without an attitude the last thrusts stay."""
    assured, vehicle, _ = flown()
    leap = 3600 * 10**9
    outcomes = []
    for tick in range(30):
        stamp = leap + (vehicle.tick + 1) * TICK_NS
        changes = {"attitude": None, "angular_velocity": None} if tick > 10 else {}
        seen = vehicle.measure(stamp_ns=stamp, wrench_stamp_ns=stamp, plane_stamp_ns=stamp, **changes)
        command = assured.step(seen, good_reference())
        assert command.stamp_ns == stamp
        outcomes.append(command.outcome)
        vehicle.fly(command.thrusts)
    assert outcomes[5] is Outcome.SOLVED and outcomes[-1] is Outcome.HOLD, "held for want of an attitude"
    assert assured.step(None, good_reference()).stamp_ns == 0


def test_a_host_that_lets_numpy_raise() -> None:
    with np.errstate(all="raise"):
        _, _, command = flown(velocity=np.full(3, 1e-200), contact_wrench=np.full(6, 1e-310))
    assert command.outcome is Outcome.SOLVED and command.rejected == ()


def test_an_unusable_contact_is_named_also_while_the_supervisor_replaces_the_law() -> None:
    assured, vehicle, _ = flown()
    nan = assured.controller.setpoints.contact._replace(distance=math.nan, known=True)
    for _ in range(20):
        command = assured.step(vehicle.measure(attitude=None, angular_velocity=None), good_reference(), nan)
        vehicle.fly(command.thrusts)
        assert "contact: not finite, or its normal has not length 1" in command.rejected
    assert command.outcome is Outcome.HOLD and command.safety is SafetyState.DEGRADED
