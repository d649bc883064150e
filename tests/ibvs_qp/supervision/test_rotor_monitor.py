"""Rotors that do not follow: which, how much they give, what is no rotor fault; the tilt after the loss of rotors."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from reach_oracle import OCTOROTOR

from allocation import allocate_least_squares, control_effectiveness
from ibvs_qp.config import SafetySettings
from ibvs_qp.config.gains import Gains
from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.supervision.rotor_monitor import ESCAPE_DISTANCE, TILT_BOUND, TILT_RATE, RotorLoss, RotorMonitor

VEHICLE = VehicleParams()
MATRIX = control_effectiveness(VEHICLE.geometry)
HOVER = np.full(6, 11.3)


def monitor(vehicle: VehicleParams = VEHICLE) -> RotorMonitor:
    return RotorMonitor(vehicle, control_effectiveness(vehicle.geometry), SafetySettings())


def watched(missing: np.ndarray, ticks: int = 20) -> tuple[str, RotorMonitor]:
    watch, text = monitor(), ""
    for number in range(ticks):
        text = watch.update(missing, 0.1, HOVER, 0.004 * number)
    return text, watch


@pytest.mark.parametrize("rotor", range(6))
@pytest.mark.parametrize("gives", [0.0, 5.0, 25.0])
def test_a_rotor_that_gives_another_thrust_is_named_with_it(rotor: int, gives: float) -> None:
    missing = np.zeros(6)
    missing[rotor] = 11.3 - gives
    text, watch = watched(missing)
    assert text == f"{VEHICLE.geometry.names[rotor]} gives {gives:.1f} N"
    assert watch.limits is not None
    lower, upper = watch.limits
    assert (lower <= upper).all()
    if gives < 11.3:
        assert upper[rotor] == pytest.approx(gives) and lower[rotor] == pytest.approx(max(gives - 0.5, 0.0))
    else:
        assert lower[rotor] == pytest.approx(gives - 0.5)
    others = np.arange(6) != rotor
    assert (lower[others] == VEHICLE.thrust_min[others]).all() and (upper[others] == VEHICLE.thrust_max[others]).all()


def weak(watch: RotorMonitor, share: float, seconds: float, begin_s: float = 0.0, commanded: float = 11.3) -> str:
    """A rotor with a fraction of its thrust, as the model with the scale of the monitor misses it."""
    text = ""
    for number in range(round(seconds / 0.004)):
        missing = np.zeros(6)
        missing[2] = commanded * (1.0 - share / watch.scale[2])
        text = watch.update(missing, 0.1, np.full(6, commanded), begin_s + 0.004 * number)
    return text


@pytest.mark.parametrize("share", [0.62, 0.7, 0.75])
def test_a_weak_rotor_is_no_fault_but_has_a_scale(share: float) -> None:
    watch = monitor()
    assert weak(watch, share, 1.0) == "" and watch.limits is None
    assert watch.scale[2] == pytest.approx(share) and np.delete(watch.scale, 2) == pytest.approx(1.0)
    assert VEHICLE.geometry.names[2] in watch.note
    assert weak(watch, 1.0, 1.0, begin_s=5.0) == "" and watch.scale[2] == pytest.approx(1.0)  # sound again


def test_a_rotor_that_no_scale_explains_is_limited() -> None:
    watch, missing = monitor(), np.zeros(6)
    missing[2] = 3.2  # whatever it is commanded
    text = [watch.update(missing, 0.1, np.full(6, 25.0), 0.004 * number) for number in range(200)]
    assert text[50] == "" and text[-1] == f"{VEHICLE.geometry.names[2]} gives 21.8 N"
    assert watch.limits is not None and watch.scale == pytest.approx(1.0)


def test_a_rotor_that_stops_after_its_scale_was_changed_is_found_at_once() -> None:
    watch = monitor()
    assert weak(watch, 0.7, 0.1) == "" and watch.scale[2] < 1.0
    assert "gives" in weak(watch, 0.1, 0.08, begin_s=0.1)


def test_another_rotor_that_stops_while_a_scale_settles_is_found_at_once() -> None:
    watch = monitor()
    assert weak(watch, 0.7, 0.1) == "" and watch.scale[2] < 1.0
    missing = np.array([0.0, 0.0, 0.0, 9.0, 0.0, 0.0])
    texts = [watch.update(missing, 0.1, HOVER, 0.1 + 0.004 * number) for number in range(20)]
    assert VEHICLE.geometry.names[3] in texts[-1]


def test_two_rotors_at_once_are_told_apart() -> None:
    missing = np.zeros(6)
    missing[[1, 4]] = 6.0, 5.0
    text, _ = watched(missing)
    assert "mid_left" in text and text.count("gives") == 2


@pytest.mark.parametrize("force", [(10.0, 0.0, 0.0), (0.0, 10.0, 0.0), (-10.0, 0.0, 0.0), (0.0, 0.0, 20.0)])
def test_a_push_on_the_body_is_no_rotor_fault(force: tuple[float, float, float]) -> None:
    text, watch = watched(-np.linalg.pinv(MATRIX) @ np.array([*force, 0.0, 0.0, 0.0]))
    assert text == "" and watch.limits is None


@pytest.mark.parametrize("size", [8.0, 16.0])
def test_wind_from_no_side_is_a_rotor_fault(size: float) -> None:
    """Along the tilt of two opposite rotors they explain a force as well as it does itself."""
    for angle in np.arange(0.0, 360.0, 5.0):
        force = size * np.cos(np.radians(angle)), size * np.sin(np.radians(angle)), 0.2 * size
        text, watch = watched(-np.linalg.pinv(MATRIX) @ np.array([*force, 0.0, 0.0, 0.03 * size]))
        assert text == "" and watch.limits is None, angle


def test_a_short_peak_is_no_fault() -> None:
    watch, missing = monitor(), np.array([10.0, 0, 0, 0, 0, 0])
    for number in range(100):
        assert not watch.update(missing if number % 10 < 8 else np.zeros(6), 0.1, HOVER, 0.004 * number)


def test_what_the_noise_may_be_is_no_fault() -> None:
    watch, missing, thrusts = monitor(), np.array([4.0, 0, 0, 0, 0, 0]), np.full(6, 7.5)
    found = [watch.update(missing, noise, thrusts, 0.1 * number) for number, noise in enumerate((1.0, 1.0, 0.3, 0.3))]
    assert [bool(text) for text in found] == [False, False, False, True], "six standard deviations, for a while"


def test_a_stuck_rotor_is_limited_from_both_sides() -> None:
    watch, lost = monitor(), np.array([3.0, 0, 0, 0, 0, 0])
    for number in range(40):
        watch.update(2.0 * lost, 0.1, HOVER, 0.004 * number)  # commanded 11.3, gives 5.3
    thrusts = HOVER.copy()
    thrusts[0] = 1.2
    for number in range(40, 80):
        watch.update(np.array([-4.1, 0, 0, 0, 0, 0]), 0.1, thrusts, 0.004 * number)  # commanded 1.2, still gives 5.3
    assert watch.limits is not None
    lower, upper = watch.limits
    assert lower[0] == pytest.approx(4.8) and upper[0] == pytest.approx(5.8)


@given(st.lists(st.floats(-60.0, 60.0), min_size=6, max_size=6))
def test_limits_are_always_limits(missing: list[float]) -> None:
    _, watch = watched(np.array(missing))
    if watch.limits is not None:
        lower, upper = watch.limits
        assert (lower <= upper).all() and (upper <= VEHICLE.thrust_max).all() and np.isfinite(lower).all()


@pytest.mark.parametrize("rotor", range(8))
def test_more_rotors_than_dimensions_are_told_apart_too(rotor: int) -> None:
    """A thrust missing at one of eight rotors spreads over the others in the least-squares sense."""
    vehicle = VehicleParams(geometry=OCTOROTOR)
    matrix = control_effectiveness(OCTOROTOR)
    watch, lost = monitor(vehicle), np.zeros(8)
    lost[rotor] = 8.0
    for number in range(20):
        text = watch.update(np.linalg.pinv(matrix) @ matrix @ lost, 0.1, np.full(8, 8.0), 0.004 * number)
    assert text == f"{OCTOROTOR.names[rotor]} gives 0.0 N"


def test_all_rotors_at_a_limit_miss_lift_and_keep_their_lower_limits() -> None:
    watch = monitor()
    wanted, limit = np.full(6, 20.0), 13.0
    for tick in range(60):
        text = watch.update(wanted - limit, 0.1, wanted, tick * 0.004)
    assert "N of lift are missing" in text and watch.limits is not None
    lower, upper = watch.limits
    assert np.abs(upper - limit).max() < 0.1 and (lower == VEHICLE.thrust_min).all()


def test_three_rotors_at_a_limit_have_it_in_common_with_the_others() -> None:
    """Each limited by itself, the others were commanded 20 N of their 13 N, and the vehicle came down."""
    watch, wanted = monitor(), np.array([20.0, 20.0, 18.0, 11.0, 10.0, 9.0])
    for tick in range(60):
        watch.update(np.maximum(wanted - 13.0, 0.0), 0.1, wanted, tick * 0.004)
    assert watch.limits is not None
    lower, upper = watch.limits
    assert upper == pytest.approx(13.0, abs=0.1) and (lower == VEHICLE.thrust_min).all()


def test_a_sagging_battery_misses_lift_and_limits_no_rotor() -> None:
    watch = monitor()
    wanted = np.full(6, 11.0)
    for tick in range(60):
        text = watch.update(0.15 * wanted, 0.1, wanted, tick * 0.004)
    assert "N of lift are missing" in text and watch.limits is None


def test_a_thrust_missed_for_some_ticks_takes_no_further_rotor_out() -> None:
    """Thrusts are shared out anew once rotors are found; those that rise fast miss some behind their lag."""
    missing = np.array([4.0, 2.6, 0.0, 0.0, 0.0, 0.0])
    _, watch = watched(missing)
    rising = np.array([2.3, 0.9, 0.2, 0.0, 0.6, 1.0])
    for number in range(5):
        text = watch.update(rising, 0.1, HOVER, 0.08 + 0.004 * number)
    first, second, *others = VEHICLE.geometry.names
    assert first in text and second in text and not any(name in text for name in others)
    assert watch.limits is not None
    np.testing.assert_array_equal(watch.limits[1][2:], VEHICLE.thrust_max[2:])


def test_a_ceiling_with_a_common_cause_rises_while_no_thrust_is_missing() -> None:
    """Found while the thrusts changed fast, ceilings were 2.5 N too low, and the vehicle could not hover any more."""
    watch, wanted = monitor(), np.full(6, 20.0)
    for tick in range(60):
        watch.update(wanted - 10.5, 0.1, wanted, tick * 0.004)
    for tick in range(60, 310):
        watch.update(np.zeros(6), 0.1, HOVER, tick * 0.004)
    assert watch.limits is not None
    np.testing.assert_allclose(watch.limits[1], 10.5 + 2.0, atol=0.1)
    for tick in range(310, 20_000):
        watch.update(np.zeros(6), 0.1, HOVER, tick * 0.004)
    assert (watch.limits[1] == VEHICLE.thrust_max).all()


def test_the_ceiling_of_a_single_stuck_rotor_stays() -> None:
    _, watch = watched(np.array([6.0, 0, 0, 0, 0, 0]))
    for number in range(20, 300):
        watch.update(np.zeros(6), 0.1, HOVER, 0.004 * number)
    assert watch.limits is not None and watch.limits[1][0] == pytest.approx(5.3)


LOWER, UPPER = np.full(6, 1.2), np.full(6, 52.56)
INTO_WALL = np.array([1.0, 0.0, 0.0])


def lost(rotor: int) -> tuple[np.ndarray, np.ndarray]:
    lower, upper = LOWER.copy(), UPPER.copy()
    lower[rotor] = upper[rotor] = 0.0
    return lower, upper


def settled(monitor: RotorLoss, distance: float, closing: float = 0.0) -> np.ndarray:
    for _ in range(1000):
        tilt = monitor.tilt(distance, closing, 0.0, INTO_WALL, 0.004)
    return tilt


def test_only_a_lost_hover_is_reported_and_only_once() -> None:
    monitor = RotorLoss(VEHICLE)
    assert not monitor.update(None) and not monitor.update((LOWER, UPPER))
    weak = UPPER.copy()
    weak[0] = 0.4 * 52.56
    assert not monitor.update((LOWER, weak)) and not monitor.lost
    assert monitor.update(lost(0)) and monitor.lost
    assert not monitor.update(lost(0)) and monitor.lost
    assert not monitor.update((LOWER, UPPER)) and not monitor.lost, "the rotor is back"


@pytest.mark.parametrize("rotor", range(6))
def test_the_trim_turns_the_remaining_force_upright(rotor: int) -> None:
    monitor, (lower, upper) = RotorLoss(VEHICLE), lost(rotor)
    monitor.update((lower, upper))
    hover = np.array([0.0, 0.0, -VEHICLE.mass_kg * 9.81, 0.0, 0.0, 0.0])
    matrix = control_effectiveness(VEHICLE.geometry)
    force = (matrix @ allocate_least_squares(hover, matrix, lower, upper + 1e-6))[:3]
    roll, pitch = settled(monitor, ESCAPE_DISTANCE)
    forward = np.array([[math.cos(pitch), 0, math.sin(pitch)], [0, 1, 0], [-math.sin(pitch), 0, math.cos(pitch)]])
    sideways = np.array([[1, 0, 0], [0, math.cos(roll), -math.sin(roll)], [0, math.sin(roll), math.cos(roll)]])
    lateral = (forward @ sideways @ force)[:2]
    assert np.linalg.norm(lateral) < 0.1 * np.linalg.norm(force[:2])


def test_tilt_leads_away_from_the_wall_within_its_bounds() -> None:
    monitor = RotorLoss(VEHICLE)
    monitor.update(lost(2))
    trim = settled(monitor, ESCAPE_DISTANCE)
    near = settled(monitor, 0.7)
    assert near[1] > trim[1], "nose up: backwards"
    assert np.hypot(*settled(monitor, 0.1, closing=5.0)) <= TILT_BOUND + 1e-12


def test_a_tilt_begins_with_the_lead_of_the_attitude_loop() -> None:
    monitor, gains, dt = RotorLoss(VEHICLE), Gains(), 0.004
    monitor.update(lost(0))
    first = monitor.tilt(ESCAPE_DISTANCE, 0.0, 0.0, INTO_WALL, dt)
    lead = gains.attitude_kd / gains.attitude_kp
    assert first == pytest.approx([0.0, -TILT_RATE * (dt + lead)])
    settled(monitor, ESCAPE_DISTANCE)
    assert np.abs(monitor.tilt(ESCAPE_DISTANCE, 0.0, 0.0, INTO_WALL, dt)).max() < TILT_BOUND


@pytest.mark.parametrize("rotor", range(6))
@pytest.mark.parametrize("thrust", [0.0, 8.0, 15.0])
def test_the_vehicle_tilts_only_where_its_rotors_give_no_force(rotor: int, thrust: float) -> None:
    monitor, (lower, upper) = RotorLoss(VEHICLE), (LOWER.copy(), UPPER.copy())
    lower[rotor] = upper[rotor] = thrust
    monitor.update((lower, upper))
    rest = settled(monitor, ESCAPE_DISTANCE)
    into, across = (settled(monitor, ESCAPE_DISTANCE, closing=speed) - rest for speed in (0.2, -0.2))
    matrix = control_effectiveness(VEHICLE.geometry)
    # Force ahead that the others give beside the hover, without moments and change of lift.
    others = np.delete(matrix, rotor, axis=1)
    free = np.linalg.svd(others[2:])[2][-1] if np.linalg.matrix_rank(others[2:]) < 5 else np.zeros(5)
    direction = (others @ free)[:2]
    assert np.linalg.norm(direction) > 0.1, "one lateral direction stays free"
    for change in (into, across):
        acceleration = np.array((-change[1], change[0]))  # ahead, right
        assert abs(float(acceleration @ direction)) < 1e-9


def test_a_vehicle_that_turned_away_stays_turned_until_its_hover_is_back() -> None:
    monitor = RotorLoss(VEHICLE)
    assert not monitor.turns(0.5), "a sound vehicle may face any way"
    monitor.update(lost(0))
    assert not monitor.turns(0.99) and monitor.turns(0.9) and monitor.turns(0.99)
    monitor.update((LOWER, UPPER))
    assert not monitor.turns(0.9)
