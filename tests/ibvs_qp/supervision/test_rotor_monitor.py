"""Rotors that do not follow: which, how much they give, and what is no rotor fault."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rotor_layouts import OCTOROTOR

from allocation import control_effectiveness
from ibvs_qp.config import SafetySettings
from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.supervision.rotor_monitor import RotorMonitor

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
