"""The supervisor around the pilot: neither strategy nor law overrules it, and faulty sensors are replaced."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from controller_scenes import FLOOR, attitude
from sensed_vehicle import SensedVehicle

from ibvs_qp.command import Command, Outcome, SafetyState
from ibvs_qp.measurement import SensorFrame
from ibvs_qp.pilot import FlightStatus, Pilot, PilotConfig
from ibvs_qp.pilot.painting.command import PainterInput, PaintingCommand
from ibvs_qp.pilot.painting.painter import Painter

#: Ticks before a fault: noise of the sensors has been seen.
QUIET = 70
NAN = np.full(3, np.nan)


class Stubborn(Painter):
    """A strategy that presses and slides whatever it is told, and notes what it is told."""

    def reset(self) -> None:
        super().reset()
        self.told: list[str] = []

    def step(self, inputs: PainterInput) -> PaintingCommand:
        return PaintingCommand(contact=True, standoff=0.02, velocity=np.array([0.05, 0.0]), guides=[], push=5.0)

    def stop(self, inputs: PainterInput, reason: str) -> None:
        self.told.append(reason)
        super().stop(inputs, reason)


@functools.cache
def built() -> Pilot:
    config = PilotConfig()
    return Pilot(config, Stubborn(config.painting))


@pytest.fixture
def pilot() -> Pilot:
    pilot = built()
    pilot.reset()
    return pilot


def flown(
    pilot: Pilot,
    vehicle: SensedVehicle,
    ticks: int,
    change: Callable[[SensorFrame], dict[str, Any]] = lambda frame: {},
    follow: Callable[[np.ndarray], np.ndarray] = lambda thrusts: thrusts,
) -> Command:
    """The last command of a flight in which sensors and rotors are changed."""
    for _ in range(ticks):
        frame = vehicle.sense()
        command = pilot.step(dataclasses.replace(frame, **change(frame)))
        vehicle.fly(follow(command.thrusts))
    return command


def standing(pilot: Pilot, ticks: int, change: Callable[[SensorFrame], dict[str, Any]]) -> Command:
    """The same of a vehicle that does not move, whatever it is commanded."""
    vehicle = SensedVehicle()
    for _ in range(ticks):
        frame = vehicle.sense()
        command = pilot.step(dataclasses.replace(frame, **change(frame)))
        vehicle.tick += 1
    return command


def test_a_strategy_that_goes_on_is_overruled_and_told(pilot: Pilot) -> None:
    vehicle = SensedVehicle()
    assert flown(pilot, vehicle, QUIET).safety is SafetyState.NOMINAL
    assert pilot.reference.contact and pilot.reference.velocity.any() and not pilot.painter.failed
    command = flown(pilot, vehicle, 50, lambda frame: {"wrench_stamp_ns": 1})
    assert command.safety is SafetyState.RETREAT and command.safety_reasons[0].startswith("no force sample: ")
    assert not pilot.reference.contact and not pilot.reference.velocity.any()
    assert pilot.reference.standoff == pilot.config.safety.retreat_m
    assert isinstance(pilot.painter, Stubborn) and pilot.painter.failed
    assert len(pilot.painter.told) == 1 and pilot.painter.told[0].startswith("no force sample: ")


def test_a_force_sensor_that_is_gone_is_replaced(pilot: Pilot) -> None:
    vehicle = SensedVehicle()
    flown(pilot, vehicle, QUIET)
    assert pilot.measurement is not None and pilot.measurement.contact_wrench.any()
    flown(pilot, vehicle, 20, lambda frame: {"wrench": np.full(6, np.nan)})
    measured = pilot.measurement
    assert measured.wrench_stamp_ns == measured.stamp_ns, "by inertial data of the tick"
    np.testing.assert_allclose(measured.contact_wrench[1:3], 0.0, atol=0.1)


def test_inertial_samples_that_repeat_are_replaced(pilot: Pilot) -> None:
    vehicle = SensedVehicle()
    flown(pilot, vehicle, QUIET)
    frozen = vehicle.sense()
    names = ("attitude", "angular_velocity", "specific_force")
    command = flown(pilot, vehicle, 20, lambda frame: {name: getattr(frozen, name) for name in names})
    assert any(reason.startswith("inertial samples repeat") for reason in command.safety_reasons)
    assert pilot.measurement is not None
    assert not np.array_equal(pilot.measurement.specific_force, frozen.specific_force)


def test_after_a_leap_of_the_clock_the_velocity_is_unknown(pilot: Pilot) -> None:
    """Or the loop stood still for as long."""
    vehicle = SensedVehicle()
    flown(pilot, vehicle, QUIET)
    assert pilot.motion.velocity_variance < 0.01
    later = 3_600_000_000_000
    for _ in range(2):
        frame = vehicle.sense(features=None)
        moved = {name: getattr(frame, name) + later for name in ("stamp_ns", "wrench_stamp_ns")}
        pilot.step(dataclasses.replace(frame, **moved))
        vehicle.tick += 1
    assert pilot.motion.velocity_variance > 0.1


def test_wrong_axes_stop_the_job_at_once(pilot: Pilot) -> None:
    flu = np.array([1.0, -1.0, -1.0])
    command = standing(pilot, 20, lambda frame: {"specific_force": flu * frame.specific_force})
    assert command.safety is SafetyState.DEGRADED and not pilot.reference.contact
    assert command.safety_reasons[0].startswith("sensor data in other axes: specific_force: ")


def test_a_camera_that_contradicts_the_filter_stops_the_travel(pilot: Pilot) -> None:
    def drifting(frame: SensorFrame) -> dict[str, Any]:
        seen = frame.features
        if seen is None or seen.velocity is None:
            return {}
        return {"features": dataclasses.replace(seen, velocity=seen.velocity + np.array([0.0, 0.5, 0.0]))}

    vehicle = SensedVehicle()
    flown(pilot, vehicle, QUIET)
    command = flown(pilot, vehicle, 90, drifting)
    assert command.safety is SafetyState.DEGRADED and not pilot.reference.velocity.any()
    assert command.safety_reasons[0].startswith("a filter refuses its measurements: camera velocity refused for 0.")


def test_without_any_attitude_the_flight_ends(pilot: Pilot) -> None:
    standing(pilot, QUIET, lambda frame: {})
    blind = {"attitude": np.full(4, np.nan), "angular_velocity": NAN, "specific_force": NAN, "features": None}
    command = standing(pilot, 1000, lambda frame: blind)
    assert command.safety is SafetyState.TERMINATED and command.thrusts.max() <= FLOOR + 1e-9
    assert any(reason.startswith("no attitude") for reason in command.safety_reasons)


def test_without_a_level_hover_it_comes_down(pilot: Pilot) -> None:
    vehicle, upper = SensedVehicle(), np.full(6, 50.0)
    flown(pilot, vehicle, QUIET)
    upper[2] = 0.0
    pilot.thrust_limits = np.zeros(6), upper
    command = standing(pilot, 1, lambda frame: {"stamp_ns": 10**9})
    command = pilot.step(dataclasses.replace(vehicle.sense(), stamp_ns=10**9 + 4_000_000))
    assert command.safety is SafetyState.DESCEND
    assert "no level hover within the thrust limits" in command.safety_reasons


def test_a_rotor_that_does_not_follow_is_limited_beside_what_the_drive_reports(pilot: Pilot) -> None:
    vehicle = SensedVehicle(distance=0.3)
    pilot.thrust_limits = np.full(6, 1.5), np.full(6, 40.0)
    flown(pilot, vehicle, 3 * QUIET)
    lost = np.array([52.0, 52.0, 7.0, 52.0, 52.0, 52.0])
    command = flown(pilot, vehicle, 110, follow=lambda thrusts: np.minimum(thrusts, lost))
    assert command.safety is not SafetyState.NOMINAL
    assert any(reason.startswith("a rotor does not follow") for reason in command.safety_reasons)
    assert pilot.measurement is not None and pilot.measurement.thrust_max is not None
    assert pilot.measurement.thrust_max[2] == pytest.approx(7.0, abs=2.0)
    assert np.delete(pilot.measurement.thrust_max, 2).max() == 40.0
    assert command.thrusts[2] <= pilot.measurement.thrust_max[2] + 1e-6


def test_a_vehicle_on_its_side_gets_no_thrust_with_or_without_a_frame(pilot: Pilot) -> None:
    fallen = {"attitude": attitude(1.3)}
    assert pilot.status == FlightStatus(
        phase="start", finished=False, failed=False, reason="", safety=SafetyState.NOMINAL, events=()
    )
    command = standing(pilot, 150, lambda frame: fallen)
    status = pilot.status
    assert status.finished and status.failed and "flipped" in status.reason and status.safety is command.safety
    assert command.safety is SafetyState.TERMINATED and command.outcome is Outcome.HOLD
    np.testing.assert_allclose(command.thrusts, FLOOR, atol=1e-6)
    broken = [pilot.step(None) for _ in range(5)]  # type: ignore[arg-type]
    for command in broken:
        assert command.safety is SafetyState.TERMINATED and command.rejected
        np.testing.assert_allclose(command.thrusts, FLOOR, atol=1e-6)


def test_without_a_frame_the_flight_ends(pilot: Pilot) -> None:
    flown(pilot, SensedVehicle(), QUIET)
    states = [pilot.step(None).safety for _ in range(150)]  # type: ignore[arg-type]
    assert states[30] is SafetyState.NOMINAL and states[70] is SafetyState.DEGRADED
    assert states[-1] is SafetyState.TERMINATED and pilot.status.finished


def test_late_inertial_samples_are_replaced(pilot: Pilot) -> None:
    """They are as noisy as ever, and their stamps tell the truth."""
    vehicle, late = SensedVehicle(0.3), list[SensorFrame]()

    def delayed(frame: SensorFrame) -> dict[str, Any]:
        late.append(frame)
        old = late[max(len(late) - 51, 0)]
        names = ("attitude", "angular_velocity", "specific_force")
        stamps = {"attitude_stamp_ns": old.stamp_ns, "imu_stamp_ns": old.stamp_ns}
        return {name: getattr(old, name) for name in names} | stamps

    flown(pilot, vehicle, QUIET)
    flown(pilot, vehicle, 10, delayed)
    command = flown(pilot, vehicle, 300, delayed)
    assert command.safety in (SafetyState.RETREAT, SafetyState.HOVER)
    assert command.safety_reasons[0].startswith("no inertial sample: ")
    assert pilot.measurement is not None
    assert not np.array_equal(pilot.measurement.angular_velocity, late[-51].angular_velocity)
    assert np.abs(vehicle.attitude.as_euler("xyz", degrees=True)).max() < 3.0


def test_a_camera_that_never_sees_anything_is_a_fault(pilot: Pilot) -> None:
    due = round(pilot.config.safety.first_picture_s / pilot.config.controller.tick_s)
    vehicle = SensedVehicle(0.5)
    assert flown(pilot, vehicle, due, lambda frame: {"features": None}).safety is SafetyState.NOMINAL
    command = flown(pilot, vehicle, 250, lambda frame: {"features": None})
    assert command.safety in (SafetyState.RETREAT, SafetyState.HOVER)
    assert {"no picture: none yet", "no wall plane: none yet"} <= set(command.safety_reasons)
