"""A controller under supervision: what its caller passes never raises, time and ages are those of its stamps."""

from __future__ import annotations

import functools
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from controller_scenes import FLOOR, TICK_NS, line_references
from hostile import Raising
from references import good_reference
from small_vehicle import SmallVehicle

from ibvs_qp.checked_law import Inputs
from ibvs_qp.command import Command, Outcome, SafetyState
from ibvs_qp.controller import HybridController
from ibvs_qp.measurement import Measurement, Reference
from ibvs_qp.supervision.assured import Assured

RATE_STEP = 500.0 * 0.004
PRESS = Reference(push_force=5.0, contact=True, lines=line_references(2))
NAN = np.full(3, np.nan)


@functools.cache
def built(number: int) -> Assured:
    """Construction costs far more than `reset`."""
    return Assured(HybridController())


def flown(number: int = 0, ticks: int = 20, **changes: Any) -> tuple[Assured, SmallVehicle, Command]:
    """A flight so far, and its last command."""
    assured = built(number)
    assured.reset()
    vehicle, command = SmallVehicle(assured.controller.config), None
    for _ in range(ticks):
        command = assured.step(vehicle.measure(**changes), good_reference())
        vehicle.fly(command.thrusts)
    return assured, vehicle, command  # type: ignore[return-value]


def pressed(assured: Assured, vehicle: SmallVehicle, ticks: int, **changes: Any) -> Command:
    """The last command of a press with sensors that are changed."""
    for _ in range(ticks):
        command = assured.step(vehicle.measure(**changes), PRESS)
        vehicle.fly(command.thrusts)
    return command


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

    monkeypatch.setattr(assured.supervision, "watch", fails)
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


def test_without_any_measurement_the_flight_ends() -> None:
    assured, vehicle, _ = flown()
    states = []
    for _ in range(150):
        command = assured.step(None, good_reference())  # type: ignore[arg-type]
        vehicle.fly(command.thrusts)
        states.append(command.safety)
    assert states[40] is SafetyState.NOMINAL and states[60] is SafetyState.DEGRADED
    assert states[-1] is SafetyState.TERMINATED and command.safety_reasons == ("no usable input",)


def test_refused_measurements_between_good_ones_are_no_fault() -> None:
    assured, vehicle, _ = flown()
    for _ in range(100):
        assured.step(None, good_reference())  # type: ignore[arg-type]
        command = assured.step(vehicle.measure(), good_reference())
        vehicle.fly(command.thrusts)
        assert command.safety is SafetyState.NOMINAL


def test_repeated_lines_with_fresh_stamps_are_no_pictures() -> None:
    rng = np.random.default_rng(0)
    assured, vehicle, _ = flown()
    frozen = None
    for tick in range(400):
        seen = noisy(vehicle.measure(), rng)
        if tick >= 200:
            frozen = frozen or seen.lines
            seen = replace(seen, lines=tuple(replace(line, stamp_ns=seen.stamp_ns) for line in frozen))
        command = assured.step(seen, good_reference())
        vehicle.fly(command.thrusts)
        if tick == 199:
            assert command.safety is SafetyState.NOMINAL
    assert command.safety is SafetyState.RETREAT and command.safety_reasons[0].startswith("pictures repeat")


def test_specific_force_in_other_axes_is_named() -> None:
    assured = built(0)
    assured.reset()
    vehicle, flu = SmallVehicle(assured.controller.config), np.array([1.0, -1.0, -1.0])
    for _ in range(60):
        seen = vehicle.measure()
        assert seen.specific_force is not None
        command = assured.step(replace(seen, specific_force=flu * seen.specific_force), good_reference())
        vehicle.tick += 1
    assert command.safety is SafetyState.RETREAT
    assert command.safety_reasons[0].startswith("sensor data in other axes: specific_force: ")
    assert any(reason.startswith("self-check: specific_force: ") for reason in command.rejected)


@pytest.mark.parametrize("rotor", [0, 2])
def test_a_lost_rotor_brings_the_vehicle_down_upright(rotor: int) -> None:
    rng = np.random.default_rng(0)
    assured = built(0)
    assured.reset()
    vehicle = SmallVehicle(assured.controller.config, distance=0.3)
    for tick in range(1500):
        command = assured.step(noisy(vehicle.measure(), rng), Reference(standoff=0.2, lines=line_references(2)))
        left = command.thrusts.copy()
        left[rotor] *= tick < 500
        vehicle.fly(left)
        assert vehicle.attitude.as_matrix()[2, 2] > math.cos(math.radians(30.0))
    assert command.safety is SafetyState.DESCEND and "no level hover" in command.safety_reasons[0]
    assert 0.2 < vehicle.velocity[2] < 1.0


def test_a_quiet_approach_is_the_controllers_own() -> None:
    assured, vehicle, _ = flown(ticks=0)
    twin, alone = SmallVehicle(assured.controller.config), HybridController()
    for _ in range(60):
        command, own = assured.step(vehicle.measure(), PRESS), alone.step(twin.measure(), PRESS)
        np.testing.assert_array_equal(command.thrusts, own.thrusts)
        assert command.safety is SafetyState.NOMINAL and command.mode == "approach"
        vehicle.fly(command.thrusts)
        twin.fly(own.thrusts)


def test_a_lost_force_sensor_ends_the_press_and_is_replaced(monkeypatch: pytest.MonkeyPatch) -> None:
    flown_by: list[Measurement | None] = []
    assured, vehicle, _ = flown(ticks=0)
    respond = assured.controller.respond

    def noted(inputs: Inputs) -> Command:
        flown_by.append(inputs.measurement)
        return respond(inputs)

    monkeypatch.setattr(assured.controller, "respond", noted)
    pressed(assured, vehicle, 20)
    command = pressed(assured, vehicle, 60, contact_wrench=NAN)
    assert command.safety is SafetyState.RETREAT and command.safety_reasons[0].startswith("no force sample: ")
    assert command.mode == "free", "no approach any more"
    last = flown_by[-1]
    assert last is not None and last.wrench_stamp_ns == last.stamp_ns and not np.isnan(last.contact_wrench).any()


def test_without_an_attitude_the_thrusts_stay_and_then_end() -> None:
    assured, vehicle, _ = flown(ticks=0)
    pressed(assured, vehicle, 20)
    held = pressed(assured, vehicle, 10, attitude=np.full(4, np.nan))
    assert held.safety is SafetyState.DEGRADED and held.outcome is Outcome.HOLD
    again = pressed(assured, vehicle, 1, attitude=np.full(4, np.nan))
    np.testing.assert_array_equal(again.thrusts, held.thrusts)
    ended = pressed(assured, vehicle, 80, attitude=np.full(4, np.nan))
    assert ended.safety is SafetyState.TERMINATED
    np.testing.assert_allclose(ended.thrusts, FLOOR, atol=1e-6)
    back = pressed(assured, vehicle, 1)
    np.testing.assert_allclose(back.thrusts, FLOOR, atol=1e-6, err_msg="the attitude is back")


def test_lines_that_stop_are_a_fault_once_there_were_some() -> None:
    assured, vehicle, _ = flown(ticks=0)
    assert pressed(assured, vehicle, 80, lines=()).safety is SafetyState.NOMINAL
    seen = vehicle.measure()
    stamped = tuple(replace(line, stamp_ns=seen.stamp_ns) for line in seen.lines)
    assert pressed(assured, vehicle, 40, lines=stamped).safety is SafetyState.NOMINAL
    command = pressed(assured, vehicle, 20, lines=())
    assert command.safety is SafetyState.DEGRADED and command.safety_reasons[0].startswith("no picture: ")


def noisy(seen: Measurement, rng: np.random.Generator) -> Measurement:
    """As a vehicle measures: the monitors take sensors without noise for those of a simulator."""
    assert seen.specific_force is not None
    lines = tuple(replace(line, rho=line.rho + rng.normal(0.0, 1e-5), stamp_ns=seen.stamp_ns) for line in seen.lines)
    return replace(
        seen,
        specific_force=seen.specific_force + rng.normal(0.0, 0.05, 3),
        angular_velocity=seen.angular_velocity + rng.normal(0.0, 0.002, 3),
        contact_wrench=seen.contact_wrench + rng.normal(0.0, 0.05, 6),
        lines=lines,
    )
