"""What the states do to references and thrusts: no new contact, away from the wall, down, and at last no thrust."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest
from safety_ticks import CONTACT, StubResponse, quiet_tick

from ibvs_qp.command import Command, Outcome, SafetyState
from ibvs_qp.config import ControllerConfig, SafetySettings
from ibvs_qp.measurement import Reference
from ibvs_qp.supervision.faults import Fault
from ibvs_qp.supervision.supervision import LEAST_STOP, Supervision

CONFIG, SETTINGS = ControllerConfig(), SafetySettings()
FLOOR, LAST = StubResponse().floor, StubResponse().last
SAMPLE = np.full(6, 0.5), 7
FREE = CONTACT._replace(in_contact=False, distance=0.2, push=0.0)
MOVING = np.array([0.1, 0.0])
PRESS = Reference(push_force=5.0, standoff=0.02, contact=True, velocity=MOVING, travel=MOVING)
COMMAND = Command(stamp_ns=0, thrusts=LAST, wrench=FLOOR, outcome=Outcome.SOLVED, mode="free", unallocated_wrench=FLOOR)
STOPPED = {"image_ns": 0, "plane_ns": 0}


def watched(ticks: int, response: StubResponse | None = None, after: Supervision | None = None, **values: Any):
    """The supervision after some equal ticks."""
    supervision = after or Supervision(CONFIG, SETTINGS)
    begin = getattr(supervision, "ticks", 0)
    for number in range(begin, begin + ticks):
        supervision.watch(quiet_tick(number, **values), response or StubResponse())
    supervision.ticks = begin + ticks  # type: ignore[attr-defined]
    return supervision


def test_while_nominal_everything_is_the_callers() -> None:
    supervision = watched(100)
    assert supervision.reference(PRESS) is PRESS and supervision.thrusts(StubResponse()) is None
    assert supervision.contact_wrench(SAMPLE, 9, False, StubResponse()) == SAMPLE
    assert supervision.limits(None) is None and supervision.faults == {}


@pytest.mark.parametrize("contact", [CONTACT, FREE])
def test_a_degraded_vehicle_neither_travels_nor_begins_to_press(contact: Any) -> None:
    degraded = watched(80, contact=contact, **STOPPED)
    assert degraded.state is SafetyState.DEGRADED
    reference = degraded.reference(PRESS)
    assert not reference.velocity.any() and not reference.travel.any()
    assert reference.contact == contact.in_contact and reference.push_force == 5.0
    assert reference.standoff == max(contact.distance, LEAST_STOP)
    free = Reference(standoff=0.5, velocity=MOVING)
    assert degraded.reference(free).standoff == 0.5 and not degraded.reference(free).contact


def test_a_retreat_leaves_the_wall_and_ends_away_from_it() -> None:
    tilted = {"down": (0.3, 0.0, 0.954)}
    retreat = watched(30, **tilted)
    assert retreat.state is SafetyState.RETREAT, "the tip is still at the wall"
    reference = retreat.reference(PRESS)
    assert reference.standoff == SETTINGS.retreat_m and not reference.velocity.any()
    assert not reference.contact and reference.push_force == 0.0
    near = FREE._replace(distance=SETTINGS.retreat_m - 0.05)
    assert watched(5, after=retreat, contact=near).state is SafetyState.RETREAT
    far = FREE._replace(distance=SETTINGS.retreat_m - 0.02)
    assert watched(5, after=retreat, contact=far).state is SafetyState.HOVER


def test_a_vehicle_far_from_the_wall_stays_there() -> None:
    distant = watched(30, contact=FREE._replace(distance=0.8), down=(0.3, 0.0, 0.954), press=False)
    assert distant.reference(PRESS).standoff == 0.8


def test_a_blind_vehicle_retreats_farther_and_comes_down() -> None:
    blind = watched(250, **STOPPED)
    assert blind.state is SafetyState.RETREAT and blind.reference(PRESS).standoff == SETTINGS.blind_retreat_m
    watched(2000, after=blind, contact=FREE, **STOPPED)
    assert blind.state is SafetyState.DESCEND
    assert blind.reference(PRESS).velocity.tolist() == [0.0, SETTINGS.descend_speed_m_s]


def test_a_descent_ends_on_the_ground_and_nowhere_else() -> None:
    def descending() -> Supervision:
        return watched(5, contact=FREE, press=False, faults={Fault.NO_HOVER: ""})

    assert watched(300, after=descending(), contact=FREE, press=False).state is SafetyState.DESCEND
    ground = StubResponse(carried_weight=30.0)
    assert watched(20, ground, descending(), contact=FREE, press=False).state is SafetyState.DESCEND, "a gust"
    landed = watched(100, ground, descending(), contact=FREE, press=False)
    assert landed.state is SafetyState.TERMINATED and np.array_equal(landed.thrusts(StubResponse()), FLOOR)


def test_without_an_attitude_the_last_thrusts_stay_and_then_none() -> None:
    supervision = watched(5, faults={Fault.NO_ATTITUDE: ""})
    np.testing.assert_array_equal(supervision.thrusts(StubResponse()), LAST)
    ended = watched(60, after=supervision, faults={Fault.NO_ATTITUDE: ""})
    np.testing.assert_array_equal(ended.thrusts(StubResponse()), FLOOR)


@pytest.mark.parametrize("values", [{"wrench_ns": 0}, {"faults": {Fault.WRENCH_FROZEN: ""}}])
def test_a_faulty_force_sensor_is_replaced_by_inertial_data(values: dict[str, Any]) -> None:
    response = StubResponse(inertial_push=7.0)
    faulty = watched(30, response, **values)
    wrench, stamp_ns = faulty.contact_wrench(SAMPLE, 9, False, response)
    assert stamp_ns == 9
    np.testing.assert_allclose(wrench[:3], -7.0 * np.array(CONTACT.normal))
    np.testing.assert_allclose(wrench[3:], np.cross(CONFIG.vehicle.tip_position_m, wrench[:3]))
    pulled, _ = faulty.contact_wrench(SAMPLE, 9, False, StubResponse(inertial_push=-3.0))
    assert not pulled.any(), "no wall pulls"
    assert not faulty.contact_wrench(SAMPLE, 9, True, response)[0].any(), "turned from the wall"


def test_a_rotor_that_does_not_follow_is_a_fault_with_limits() -> None:
    lost = np.zeros(6)
    lost[2] = 8.0
    supervision = watched(30, StubResponse(missing_thrust=lost))
    assert supervision.state is SafetyState.RETREAT and Fault.ROTOR in supervision.faults
    limits = supervision.limits(None)
    assert limits is not None and limits[1][2] == pytest.approx(3.3)


def test_a_weak_rotor_gets_more_command_within_limits_and_rate() -> None:
    weak, response = np.zeros(6), StubResponse()
    thrusts = np.asarray(response.motor_thrusts, float)
    weak[2] = 0.3 * thrusts[2]
    supervision, last = Supervision(CONFIG, SafetySettings()), thrusts
    for number in range(60):
        scale = supervision.limits(None)
        missing = weak if scale is None else np.zeros(6)
        supervision.watch(quiet_tick(number), StubResponse(missing_thrust=missing))
        command = supervision.explained(dataclasses.replace(COMMAND, thrusts=thrusts))
        assert np.abs(command.thrusts - last).max() <= 2.0 + 1e-9  # 500 N/s
        last = command.thrusts
    assert supervision.state is SafetyState.NOMINAL and not supervision.faults
    assert command.thrusts == pytest.approx(np.where(np.arange(6) == 2, thrusts / 0.7, thrusts))
    limits = supervision.limits(None)
    assert limits is not None and limits[1][2] == pytest.approx(0.7 * 52.56) and limits[1][0] == 52.56


def test_a_terminated_vehicle_with_a_weak_rotor_gets_the_floor() -> None:
    supervision = watched(60, StubResponse(missing_thrust=np.where(np.arange(6) == 2, 3.4, 0.0)))
    assert supervision.rotor_note
    watched(100, after=supervision, down=(0.95, 0.0, 0.31))
    assert supervision.state is SafetyState.TERMINATED
    for _ in range(10):
        command = supervision.explained(dataclasses.replace(COMMAND, thrusts=FLOOR.copy()))
    np.testing.assert_array_equal(command.thrusts, FLOOR)


def test_thrusts_of_a_command_are_the_callers() -> None:
    supervision = watched(30, StubResponse(missing_thrust=np.where(np.arange(6) == 2, 3.4, 0.0)))
    first = supervision.explained(COMMAND)
    before = first.thrusts.copy()
    first.thrusts[:] = 0.0
    second = supervision.explained(COMMAND)
    assert np.abs(second.thrusts - before).max() <= 2.0 + 1e-9


def test_repeated_pictures_of_a_camera_with_noise_are_no_news() -> None:
    supervision, off = Supervision(CONFIG, SETTINGS), Supervision(CONFIG, SafetySettings(supervise=False))
    for each in (supervision, off):
        assert all(each.is_new_picture(number) for number in range(20))
    assert not supervision.is_new_picture(19) and supervision.is_new_picture(20) and off.is_new_picture(19)


def test_the_command_tells_state_and_reasons() -> None:
    assert watched(5).explained(COMMAND) is COMMAND
    command = watched(30, down=(0.3, 0.0, 0.954)).explained(COMMAND)
    assert command.safety is SafetyState.RETREAT and command.safety_reasons[0].startswith("tilt: ")
