"""Hover: reach in level flight and its polygon, and the least tilt, against linear programs and scans."""

from __future__ import annotations

import math

import numpy as np
import pytest
from reach_oracle import FULL, IDLE, LOWER, OCTOROTOR, UPPER, WEIGHT, by_linear_program
from scipy.optimize import linprog

from allocation import (
    TAROT_T960,
    RotorGeometry,
    WrenchFacets,
    control_effectiveness,
    hover_wrench,
    least_hover_tilt,
    level_polygon,
    worst_level_reach,
)

B, FACETS = control_effectiveness(TAROT_T960), WrenchFacets(TAROT_T960)


def level(azimuth: float) -> np.ndarray:
    """Horizontal force of 1 N along an azimuth from front to right [rad]."""
    return np.array([math.cos(azimuth), math.sin(azimuth), 0.0, 0.0, 0.0, 0.0])


@pytest.mark.parametrize(
    ("mass", "idle", "best", "worst", "side"),
    [
        (4.0, 0.0, 22.7, 11.3, 13.1),
        (6.0, 0.0, 34.0, 17.0, 19.6),
        (6.0, IDLE, 30.4, 15.2, None),
        (9.0, IDLE, 47.4, 23.7, None),
    ],
)
def test_level_reach_figures(mass: float, idle: float, best: float, worst: float, side: float | None) -> None:
    wanted = dict.fromkeys((0.0, 120.0, 240.0), best) | dict.fromkeys((60.0, 180.0, 300.0), worst)
    for azimuth_deg, reach in (wanted | ({-90.0: side} if side else {})).items():
        found = FACETS.interval(hover_wrench(mass * 9.81), level(math.radians(azimuth_deg)), idle, FULL)[1]
        assert found == pytest.approx(reach, abs=0.06)
    assert worst_level_reach(FACETS, mass * 9.81, idle, FULL)[0] == pytest.approx(worst, abs=0.06)


def test_interval_equals_the_linear_program_and_the_closed_form_of_the_square_matrix() -> None:
    # Six rotors, regular B: thrusts are unique, so the reach ends at the first rotor that meets a limit.
    rng = np.random.default_rng(5)
    for _ in range(20):
        wrench, direction = hover_wrench(WEIGHT) + rng.normal(size=6) * [3, 3, 5, 0.4, 0.4, 0.4], rng.normal(size=6)
        start, rate = np.linalg.solve(B, wrench), np.linalg.solve(B, direction)
        room = np.where(rate > 0, FULL - start, IDLE - start) / rate
        reach = FACETS.interval(wrench, direction, IDLE, FULL)[1]
        assert reach == pytest.approx(room.min(), rel=1e-7)
        assert reach == pytest.approx(by_linear_program(B, wrench, direction, LOWER, UPPER, 1.0), rel=1e-7)


def test_a_wrench_is_attainable_while_every_rotor_is_within_its_limits() -> None:
    for push, weight in ((0.0, WEIGHT), (20.0, WEIGHT), (40.0, WEIGHT), (0.0, 10.0 * WEIGHT)):
        wrench = hover_wrench(weight) + push * level(0.0)
        thrusts = np.linalg.solve(B, wrench)
        within = min((thrusts - IDLE).min(), (FULL - thrusts).min()) >= 0.0
        assert FACETS.contains(wrench, IDLE, FULL) == within


def test_level_polygon_is_the_triangle_and_every_corner_attainable() -> None:
    corners = level_polygon(FACETS, WEIGHT, IDLE, FULL)
    assert corners.shape == (3, 2)
    np.testing.assert_allclose(np.linalg.norm(corners, axis=1), 30.383, atol=1e-3)
    for front, right in corners:
        assert FACETS.contains(np.array((front, right, -WEIGHT, 0.0, 0.0, 0.0)), IDLE - 1e-7, FULL)
    polygon = level_polygon(FACETS, WEIGHT, IDLE, np.random.default_rng(1).uniform(13.0, 25.0, 6))
    edge = np.roll(polygon, -1, axis=0) - polygon
    following = np.roll(edge, -1, axis=0)
    assert np.all(edge[:, 0] * following[:, 1] - edge[:, 1] * following[:, 0] > 0.0)


@pytest.mark.parametrize("geometry", [TAROT_T960, OCTOROTOR])
def test_worst_direction_of_an_uneven_set_against_a_scan(geometry: RotorGeometry) -> None:
    facets, lower, upper = WrenchFacets(geometry), np.full(geometry.count, IDLE), np.full(geometry.count, FULL)
    upper[2] = 0.3 * FULL
    worst, azimuth = worst_level_reach(facets, WEIGHT, lower, upper)

    def reach(angle: float) -> float:
        return by_linear_program(facets.matrix, hover_wrench(WEIGHT), level(angle), lower, upper, 1.0)

    scan = [reach(angle) for angle in np.radians(np.arange(0.0, 360.0, 2.0))]
    assert worst == pytest.approx(min(scan), rel=1e-3) and worst <= min(scan) + 1e-9
    assert reach(azimuth) == pytest.approx(worst, abs=1e-6)
    polygon = level_polygon(facets, WEIGHT, lower, upper)
    for front, right in polygon:
        distance = math.hypot(front, right)
        assert reach(math.atan2(right, front)) == pytest.approx(distance, abs=1e-5)


@pytest.mark.parametrize("lost", range(6))
def test_a_lost_rotor_leaves_no_level_hover(lost: int) -> None:
    upper = UPPER.copy()
    upper[lost] = IDLE + 1e-3
    assert not FACETS.contains(hover_wrench(WEIGHT), IDLE, upper)
    assert worst_level_reach(FACETS, WEIGHT, IDLE, upper)[0] == -math.inf


def stuck(rotor: int, thrust: float) -> tuple[np.ndarray, np.ndarray]:
    lower, upper = LOWER.copy(), UPPER.copy()
    lower[rotor] = upper[rotor] = thrust
    return lower, upper


def exists(tilt: float, lower: np.ndarray, upper: np.ndarray, hold_yaw: bool) -> bool:
    """Whether a linear program finds thrusts for a hover at this tilt in any of 24 directions."""
    rows = slice(None) if hold_yaw else slice(5)
    for azimuth in np.radians(np.arange(0.0, 360.0, 15.0)):
        wrench = hover_wrench(WEIGHT * math.cos(math.radians(tilt)))
        wrench += WEIGHT * math.sin(math.radians(tilt)) * level(azimuth)
        found = linprog(np.zeros(6), A_eq=B[rows], b_eq=wrench[rows], bounds=np.column_stack((lower, upper)))
        if found.status == 0:
            return True
    return False


def test_sound_rotors_hover_level() -> None:
    assert least_hover_tilt(FACETS, WEIGHT, LOWER, UPPER, hold_yaw=True) == 0.0
    assert least_hover_tilt(FACETS, WEIGHT, LOWER, UPPER, centre=(0.03, -0.03, 0.0), hold_yaw=True) == 0.0


@pytest.mark.parametrize("rotor", [0, 2, 3])
def test_a_lost_rotor_leaves_a_tilted_hover_that_turns(rotor: int) -> None:
    lower, upper = stuck(rotor, 0.0)
    tilt = least_hover_tilt(FACETS, WEIGHT, lower, upper)
    assert 0.0 < tilt < 3.0
    assert exists(tilt + 0.5, lower, upper, hold_yaw=False) and not exists(tilt - 0.5, lower, upper, hold_yaw=False)
    assert least_hover_tilt(FACETS, WEIGHT, lower, upper, hold_yaw=True) == math.inf


def test_a_stuck_rotor_is_carried_up_to_some_thrust() -> None:
    tilts = [least_hover_tilt(FACETS, WEIGHT, *stuck(0, thrust)) for thrust in (8.0, 15.0, 20.0, 30.0, 45.0)]
    assert tilts == [0.0, 0.0, 0.0, math.inf, math.inf]
    assert not exists(20.0, *stuck(0, 45.0), hold_yaw=False)


def test_weak_rotors_hover_as_long_as_their_lift_suffices() -> None:
    # Hover takes 11.33 N of each rotor: 21.6 % of the full thrust.
    assert least_hover_tilt(FACETS, WEIGHT, LOWER, 0.25 * UPPER, hold_yaw=True) == 0.0
    assert least_hover_tilt(FACETS, WEIGHT, LOWER, 0.21 * UPPER) == math.inf
    # With the weight 0.1 m ahead the front rotors need more than they have.
    assert least_hover_tilt(FACETS, WEIGHT, LOWER, 0.25 * UPPER, centre=(0.1, 0.0, 0.0)) == math.inf
