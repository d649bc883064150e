"""Allocation: hover and lateral signs, optimality against brute force, reach against the published figures."""

import itertools
import math

import numpy as np
import pytest
from reach_oracle import by_linear_program
from rotor_layouts import OCTOROTOR

from allocation import (
    DEFAULT_ROW_WEIGHTS,
    TAROT_T960,
    WrenchFacets,
    allocate_least_squares,
    allocate_pseudo_inverse,
    control_effectiveness,
    level_polygon,
    worst_level_reach,
)

G = 9.81
IDLE, FULL = 1.2, 52.56
B, FACETS = control_effectiveness(TAROT_T960), WrenchFacets(TAROT_T960)
LOWER, UPPER = np.full(6, IDLE), np.full(6, FULL)


def hover(*more: float, mass: float = 6.0) -> np.ndarray:
    """Wrench of a level hover, plus up to six more entries."""
    return np.array([0.0, 0.0, -mass * G, 0.0, 0.0, 0.0]) + np.pad(np.array(more, float), (0, 6 - len(more)))


def test_six_equal_hover_thrusts():
    clipped, unclipped = allocate_pseudo_inverse(hover(), TAROT_T960, LOWER, UPPER)
    equal = 6.0 * G / (6.0 * math.cos(math.radians(30.0)))
    np.testing.assert_allclose(clipped, equal, atol=1e-9)
    np.testing.assert_array_equal(clipped, unclipped)
    np.testing.assert_allclose(allocate_least_squares(hover(), B, LOWER, UPPER), equal, atol=1e-9)


@pytest.mark.parametrize(
    ("name", "front", "right", "yaw_sign"),
    [
        ("mid_right", 0.5, 0.0, -1),
        ("mid_left", 0.5, 0.0, 1),
        ("front_left", -0.25, -0.4330127, -1),
        ("rear_right", -0.25, -0.4330127, 1),
        ("front_right", -0.25, 0.4330127, 1),
        ("rear_left", -0.25, 0.4330127, -1),
    ],
)
def test_lateral_force_and_yaw_sign_of_each_rotor(name, front, right, yaw_sign):
    column = B[:, TAROT_T960.names.index(name)]
    np.testing.assert_allclose(column[:3], [front, right, -math.cos(math.radians(30.0))], atol=1e-7)
    # A counter-clockwise rotor drags the vehicle clockwise (+z) and its tilt pushes the same way.
    assert column[5] * yaw_sign == pytest.approx(0.48 * 0.5 + 0.020 * math.cos(math.radians(30.0)), abs=1e-12)


def test_pseudo_inverse_meets_every_attainable_wrench_and_clips_the_rest():
    wanted = hover(10.0, -3.0, 5.0, 0.5, -0.4, 0.3)
    clipped, _ = allocate_pseudo_inverse(wanted, B, LOWER, UPPER)
    np.testing.assert_allclose(B @ clipped, wanted, atol=1e-9)
    clipped, unclipped = allocate_pseudo_inverse(hover(40.0, 0, 0, 0, 0, 0), B, LOWER, UPPER)
    assert unclipped.min() < IDLE and clipped.min() == IDLE
    # The figure the QP is compared with: rotors raised to the floor lift the vehicle.
    assert (B @ clipped)[2] < -6.0 * G - 5.0


@pytest.mark.parametrize("push", [20.0, 35.0, 60.0])
def test_least_squares_equals_brute_force_over_active_sets(push):
    wanted, weights = hover(push, 4.0, 0, 0, 0, 0.6 * push / 10), np.array(DEFAULT_ROW_WEIGHTS)
    matrix, target = weights[:, None] * B, weights * wanted
    best = math.inf
    for state in itertools.product((-1, 0, 1), repeat=6):
        free = np.array(state) == 0
        thrusts = np.where(np.array(state) < 0, LOWER, UPPER)
        if free.any():
            rest = target - matrix[:, ~free] @ thrusts[~free]
            thrusts[free] = np.linalg.lstsq(matrix[:, free], rest, rcond=None)[0]
        if np.all(thrusts >= LOWER - 1e-9) and np.all(thrusts <= UPPER + 1e-9):
            best = min(best, float(np.linalg.norm(matrix @ thrusts - target)))
    found = allocate_least_squares(wanted, B, LOWER, UPPER)
    assert np.all(found >= LOWER) and np.all(found <= UPPER)
    assert np.linalg.norm(matrix @ found - target) == pytest.approx(best, abs=1e-8)


def test_least_squares_keeps_height_and_level_where_clipping_climbs():
    wanted = hover(45.0, 0, 0, 0, 0, 0)
    held = B @ allocate_least_squares(wanted, B, LOWER, UPPER)
    clipped = B @ allocate_pseudo_inverse(wanted, B, LOWER, UPPER)[0]
    assert abs(held[2] - wanted[2]) < 1.5 < 8.0 < abs(clipped[2] - wanted[2])
    assert np.abs(held[3:5]).max() < 0.1


def level_reach(azimuth_deg: float, lower=IDLE, upper=FULL, mass: float = 6.0) -> float:
    """Greatest level force along an azimuth from front to right [N]."""
    azimuth = math.radians(azimuth_deg)
    return FACETS.interval(
        hover(mass=mass), np.array([math.cos(azimuth), math.sin(azimuth), 0, 0, 0, 0]), lower, upper
    )[1]


@pytest.mark.parametrize(
    ("mass", "idle", "best", "worst", "side"),
    [
        (4.0, 0.0, 22.7, 11.3, 13.1),
        (6.0, 0.0, 34.0, 17.0, 19.6),
        (6.0, IDLE, 30.4, 15.2, None),
        (9.0, IDLE, 47.4, 23.7, None),
    ],
)
def test_level_reach_figures(mass, idle, best, worst, side):
    for azimuth in (0.0, 120.0, 240.0):
        assert level_reach(azimuth, idle, mass=mass) == pytest.approx(best, abs=0.06)
    for azimuth in (60.0, 180.0, 300.0):
        assert level_reach(azimuth, idle, mass=mass) == pytest.approx(worst, abs=0.06)
    assert worst_level_reach(FACETS, mass * G, idle, FULL)[0] == pytest.approx(worst, abs=0.06)
    if side is not None:
        assert level_reach(-90.0, idle, mass=mass) == pytest.approx(side, abs=0.06)


@pytest.mark.parametrize(("upper", "push"), [(30.0, 28.0), (25.0, 20.5), (20.0, 13.0), (18.0, 10.0), (15.0, 5.5)])
def test_derated_limits_cut_the_push(upper, push):
    assert level_reach(0.0, upper=upper) == pytest.approx(push, abs=0.06)


def test_interval_equals_the_linear_program_and_the_closed_form_of_the_square_matrix():
    # Six rotors, regular B: thrusts are unique, so the reach ends at the first rotor that meets a limit.
    rng = np.random.default_rng(5)
    for _ in range(20):
        wrench, direction = hover() + rng.normal(size=6) * [3, 3, 5, 0.4, 0.4, 0.4], rng.normal(size=6)
        start, rate = np.linalg.solve(B, wrench), np.linalg.solve(B, direction)
        room = np.where(rate > 0, FULL - start, IDLE - start) / rate
        reach = FACETS.interval(wrench, direction, IDLE, FULL)[1]
        assert reach == pytest.approx(room.min(), rel=1e-7)
        assert reach == pytest.approx(by_linear_program(B, wrench, direction, LOWER, UPPER, 1.0), rel=1e-7)


def test_a_wrench_is_attainable_while_every_rotor_is_within_its_limits():
    for wrench in (hover(), hover(20.0, 0, 0, 0, 0, 0), hover(40.0, 0, 0, 0, 0, 0), hover(mass=60.0)):
        thrusts = np.linalg.solve(B, wrench)
        within = min((thrusts - IDLE).min(), (FULL - thrusts).min()) >= 0.0
        assert FACETS.contains(wrench, IDLE, FULL) == within


def test_level_polygon_is_the_triangle_and_every_corner_attainable():
    corners = level_polygon(FACETS, 6.0 * G, IDLE, FULL)
    assert corners.shape == (3, 2)
    np.testing.assert_allclose(np.linalg.norm(corners, axis=1), 30.383, atol=1e-3)
    for front, right in corners:
        assert FACETS.contains(hover(front, right, 0, 0, 0, 0), IDLE - 1e-7, FULL)
    polygon = level_polygon(FACETS, 6.0 * G, IDLE, np.random.default_rng(1).uniform(13.0, 25.0, 6))
    edge = np.roll(polygon, -1, axis=0) - polygon
    following = np.roll(edge, -1, axis=0)
    assert np.all(edge[:, 0] * following[:, 1] - edge[:, 1] * following[:, 0] > 0.0)


@pytest.mark.parametrize("geometry", [TAROT_T960, OCTOROTOR])
def test_worst_direction_of_an_uneven_set_against_a_scan(geometry):
    facets, lower, upper = WrenchFacets(geometry), np.full(geometry.count, IDLE), np.full(geometry.count, FULL)
    upper[2] = 0.3 * FULL
    worst, azimuth = worst_level_reach(facets, 6.0 * G, lower, upper)

    def reach(angle: float) -> float:
        direction = np.array([math.cos(angle), math.sin(angle), 0.0, 0.0, 0.0, 0.0])
        return by_linear_program(facets.matrix, hover(), direction, lower, upper, 1.0)

    scan = [reach(angle) for angle in np.radians(np.arange(0.0, 360.0, 2.0))]
    assert worst == pytest.approx(min(scan), rel=1e-3) and worst <= min(scan) + 1e-9
    assert reach(azimuth) == pytest.approx(worst, abs=1e-6)
    polygon = level_polygon(facets, 6.0 * G, lower, upper)
    for front, right in polygon:
        distance = math.hypot(front, right)
        assert reach(math.atan2(right, front)) == pytest.approx(distance, abs=1e-5)


def test_lost_rotor_leaves_no_level_hover():
    for lost in range(6):
        upper = np.full(6, FULL)
        upper[lost] = IDLE + 1e-3
        assert not FACETS.contains(hover(), IDLE, upper)
        assert worst_level_reach(FACETS, 6.0 * G, IDLE, upper)[0] == -math.inf
