"""Every monitor finds its fault in time, and nothing in a quiet flight."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from safety_ticks import CONTACT, TICK_NS, StubResponse, quiet_tick

from ibvs_qp.command import Outcome, SafetyState
from ibvs_qp.config import ControllerConfig, SafetySettings
from ibvs_qp.supervision.faults import Fault
from ibvs_qp.supervision.supervision import Supervision

BEGIN = 200
CONFIG = ControllerConfig()


def first_found(
    change: Callable[[int], dict[str, Any]], response: StubResponse | None = None, ticks: int = 500
) -> dict[Fault, float]:
    """Time from a change at tick `BEGIN` to the first detection of every fault [s]."""
    supervision, quiet, found = Supervision(CONFIG, SafetySettings()), StubResponse(), {}
    for number in range(BEGIN + ticks):
        changed = number >= BEGIN
        values = change(number) if changed else {}
        picture = values.pop("picture", number)
        if picture is not None:
            supervision.is_new_picture(picture)
        tick = quiet_tick(number, **values)
        supervision.watch(tick, response if changed and response else quiet)
        for fault in tick.faults:
            found.setdefault(fault, (number - BEGIN) * TICK_NS * 1e-9)
    return found


def test_a_quiet_flight_has_no_fault() -> None:
    assert first_found(lambda number: {}) == {}


STOPPED = BEGIN * TICK_NS


@pytest.mark.parametrize(
    ("fault", "latest_s", "change"),
    [
        (Fault.IMU_STALE, 0.03, lambda n: {"imu_ns": STOPPED}),
        (Fault.WRENCH_STALE, 0.04, lambda n: {"wrench_ns": STOPPED}),
        (Fault.IMAGE_STALE, 0.21, lambda n: {"image_ns": STOPPED, "picture": None}),
        (Fault.PLANE_STALE, 0.31, lambda n: {"plane_ns": STOPPED}),
        (Fault.IMU_FROZEN, 0.03, lambda n: {"inertial": 7}),
        (Fault.WRENCH_FROZEN, 0.05, lambda n: {"wrench": 7}),
        (Fault.IMAGE_FROZEN, 0.05, lambda n: {"picture": 7}),
        (Fault.PUSH_HIGH, 0.11, lambda n: {"contact": CONTACT._replace(push=11.5)}),
        (Fault.TILT, 0.11, lambda n: {"down": (math.sin(0.23), 0.0, math.cos(0.23))}),
        (Fault.RATE, 0.11, lambda n: {"rate": (0.0, 2.5, 2.5)}),
        (Fault.SPEED, 0.11, lambda n: {"speed": 0.8}),
        (Fault.HEIGHT, 0.11, lambda n: {"height": -2.6}),
        (Fault.WALL_GONE, 0.11, lambda n: {"contact": CONTACT._replace(in_contact=False, distance=0.05, push=0.0)}),
        (Fault.SOLVER, 0.0, lambda n: {"outcome": Outcome.ANALYTIC_FALLBACK}),
    ],
)
def test_a_fault_is_found_in_time_and_alone(
    fault: Fault, latest_s: float, change: Callable[[int], dict[str, Any]]
) -> None:
    found = first_found(change)
    assert set(found) == {fault} and found[fault] <= latest_s


@pytest.mark.parametrize("pressed_ticks", range(150, 300, 10))
def test_a_hard_push_may_follow_its_reference_down(pressed_ticks: int) -> None:
    """The reference falls slowly, as the reach does: its largest value of the release is not long ago at any end."""
    released = BEGIN + pressed_ticks

    def change(number: int) -> dict[str, Any]:
        reference = 14.0 - 0.002 * (number - BEGIN) if number < released else 0.0
        push = min(14.0, 14.0 * math.exp(-(number - released) * TICK_NS * 1e-9 / 0.25))
        return {"push_reference": reference, "contact": CONTACT._replace(push=push)}

    assert first_found(change, ticks=pressed_ticks + 100) == {}


def test_a_contact_that_is_not_found_again_is_a_fault_after_a_while() -> None:
    found = first_found(
        lambda number: {"contact": CONTACT._replace(in_contact=False, distance=0.005, push=0.0)}, ticks=1400
    )
    assert set(found) == {Fault.CONTACT_LOST} and found[Fault.CONTACT_LOST] == pytest.approx(5.0, abs=0.01)


def test_before_the_first_touch_no_contact_is_missed() -> None:
    supervision = Supervision(CONFIG, SafetySettings())
    for number in range(2000):
        tick = quiet_tick(number, contact=CONTACT._replace(in_contact=False, distance=0.2, push=0.0))
        supervision.watch(tick, StubResponse(inertial_push=0.0))
        assert not tick.faults


def test_a_flipped_vehicle_is_terminated() -> None:
    supervision = Supervision(CONFIG, SafetySettings())
    for number in range(100):
        supervision.watch(quiet_tick(number, down=(0.95, 0.0, 0.31)), StubResponse())
    assert supervision.state is SafetyState.TERMINATED
    np.testing.assert_array_equal(supervision.thrusts(StubResponse()), StubResponse().floor)


def test_mission_time_ends_the_flight() -> None:
    supervision = Supervision(CONFIG, SafetySettings(mission_s=1.0))
    for number in range(300):
        supervision.watch(quiet_tick(number), StubResponse())
    assert supervision.state in (SafetyState.RETREAT, SafetyState.HOVER)


@pytest.mark.parametrize(
    ("inertial", "measured", "wind", "finds"),
    [
        (9.0, 0.0, 0.0, True),
        (9.0, 5.0, 0.0, False),
        (7.0, 0.0, 0.0, False),
        (30.0, 10.0, 0.0, False),
        (10.0, 1.0, 1.0, True),
        (10.0, 1.0, 2.0, False),  # the wind along the wall explains it
        (10.5, 0.0, 5.0, True),  # no wind excuses a dead sensor for long
        # A sensor that follows is not dead: 14.8 N by inertial data and 4 N measured of 5 N asked in gusts of 3 N rms.
        (16.0, 3.0, 2.0, False),
        (18.5, 3.0, 2.0, True),
    ],
)
def test_a_push_must_be_measured_by_the_force_sensor(
    inertial: float, measured: float, wind: float, finds: bool
) -> None:
    response = StubResponse(inertial_push=inertial, wind_spread=wind)
    found = first_found(lambda number: {"contact": CONTACT._replace(push=measured)}, response)
    assert (Fault.PUSH_UNFELT in found) is finds


def test_a_sensor_that_dies_no_longer_follows() -> None:
    found = first_found(
        lambda number: {"contact": CONTACT._replace(push=0.0)}, StubResponse(inertial_push=12.0, wind_spread=5.0)
    )
    assert 0.2 < found[Fault.PUSH_UNFELT] < 0.4


@pytest.mark.parametrize(("pressed", "finds"), [(11.5, False), (20.0, True)])
def test_a_gust_that_takes_the_tip_off_the_wall_is_no_failed_sensor(pressed: float, finds: bool) -> None:
    """The force of the gust was known while the sensor followed; a dead sensor presses harder."""
    response = StubResponse(inertial_push=18.0, wind_spread=3.5)

    def blown_off(number: int) -> dict[str, Any]:
        off = number > BEGIN + 400
        response.inertial_push = pressed if off else 18.0
        return {"contact": CONTACT._replace(push=0.0 if off else 5.0)}

    assert (Fault.PUSH_UNFELT in first_found(blown_off, response)) is finds


@pytest.mark.parametrize(("inertial", "finds"), [(12.0, False), (16.0, True)])
def test_wind_of_free_flight_blows_on_before_the_touch(inertial: float, finds: bool) -> None:
    """Friction is no part of it; 11 N along the normal ended flights in gusts of 4 N rms before they pressed."""

    def approaching(number: int) -> dict[str, Any]:
        far = number < BEGIN + 250
        contact = CONTACT._replace(push=0.0, distance=0.3 if far else 0.005, in_contact=False)
        return {"contact": contact, "press": not far}

    found = first_found(approaching, StubResponse(inertial_push=inertial, wind_spread=2.6), 500)
    assert (Fault.PUSH_UNFELT in found) is finds


def test_far_from_the_wall_wind_is_no_push() -> None:
    found = first_found(
        lambda number: {"contact": CONTACT._replace(push=0.0, distance=0.3, in_contact=False), "press": False},
        StubResponse(inertial_push=20.0),
    )
    assert Fault.PUSH_UNFELT not in found


def test_a_simulator_without_noise_may_repeat_its_values() -> None:
    supervision = Supervision(CONFIG, SafetySettings())
    for number in range(1000):
        assert supervision.is_new_picture(0)
        tick = quiet_tick(number, inertial=0, wrench=0)
        supervision.watch(tick, StubResponse())
        assert not tick.faults


def test_without_a_camera_nothing_is_late() -> None:
    """A loop of one's own may have neither plane nor lines."""
    supervision = Supervision(CONFIG, SafetySettings())
    for number in range(200):
        tick = quiet_tick(number, plane_ns=-1, image_ns=-1)
        supervision.watch(tick, StubResponse())
        assert not tick.faults


def test_a_wall_that_noise_hides_is_lost_with_its_cause() -> None:
    supervision = Supervision(CONFIG, SafetySettings())
    tick = quiet_tick(200, plane_ns=0, plane_doubt="depth scatters")
    supervision.watch(tick, StubResponse())
    assert tick.faults[Fault.PLANE_STALE].endswith(" limit 300 ms; depth scatters")
    tick = quiet_tick(200, plane_ns=0, image_ns=0, plane_doubt="depth scatters")  # now it is the camera
    supervision.watch(tick, StubResponse())
    assert tick.faults[Fault.PLANE_STALE].endswith(" limit 300 ms") and Fault.IMAGE_STALE in tick.faults


@pytest.mark.parametrize(("stamp", "fault"), [("imu_ns", Fault.IMU_STALE), ("wrench_ns", Fault.WRENCH_STALE)])
def test_a_sensor_that_must_be_there_and_never_sent_is_late(stamp: str, fault: Fault) -> None:
    supervision = Supervision(CONFIG, SafetySettings())
    for number in range(20):
        tick = quiet_tick(number, **{stamp: -1})
        supervision.watch(tick, StubResponse())
    assert tick.faults == {fault: "none yet"}


def test_supervision_can_be_switched_off() -> None:
    supervision = Supervision(CONFIG, SafetySettings(supervise=False))
    for number in range(100):
        tick = quiet_tick(number, down=(1.0, 0.0, 0.0))
        supervision.watch(tick, StubResponse())
    assert tick.faults and supervision.state is SafetyState.NOMINAL
