"""Allocators: hover, optimality against brute force, what yields, PX4's order and the order for tilted rotors."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from reach_oracle import LOWER, OCTOROTOR, UPPER, WEIGHT

from allocation import (
    DEFAULT_ROW_WEIGHTS,
    FULLY_ACTUATED_ORDER,
    TAROT_T960,
    RotorGeometry,
    allocate_least_squares,
    allocate_pseudo_inverse,
    allocate_px4,
    allocate_sequential,
    control_effectiveness,
)

B = control_effectiveness(TAROT_T960)


def hover(*more: float, weight: float = WEIGHT) -> np.ndarray:
    """Wrench of a level hover, plus up to six more entries."""
    return np.array([0.0, 0.0, -weight, 0.0, 0.0, 0.0]) + np.pad(np.array(more, float), (0, 6 - len(more)))


def test_six_equal_hover_thrusts() -> None:
    equal = WEIGHT / (6.0 * math.cos(math.radians(30.0)))
    for thrusts in (
        *allocate_pseudo_inverse(hover(), TAROT_T960, LOWER, UPPER),
        allocate_least_squares(hover(), B, LOWER, UPPER),
    ):
        np.testing.assert_allclose(thrusts, equal, atol=1e-9)


def test_pseudo_inverse_meets_every_attainable_wrench_and_clips_the_rest() -> None:
    wanted = hover(10.0, -3.0, 5.0, 0.5, -0.4, 0.3)
    clipped, _ = allocate_pseudo_inverse(wanted, B, LOWER, UPPER)
    np.testing.assert_allclose(B @ clipped, wanted, atol=1e-9)
    clipped, unclipped = allocate_pseudo_inverse(hover(40.0), B, LOWER, UPPER)
    assert unclipped.min() < LOWER[0] and clipped.min() == LOWER[0]
    # The figure the QP is compared with: rotors raised to the floor lift the vehicle.
    assert (B @ clipped)[2] < -WEIGHT - 5.0


@pytest.mark.parametrize("push", [20.0, 35.0, 60.0])
def test_least_squares_equals_brute_force_over_active_sets(push: float) -> None:
    wanted, weights = hover(push, 4.0, 0.0, 0.0, 0.0, 0.06 * push), np.array(DEFAULT_ROW_WEIGHTS)
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


def test_least_squares_keeps_height_and_level_where_clipping_climbs() -> None:
    wanted = hover(45.0)
    held = B @ allocate_least_squares(wanted, B, LOWER, UPPER)
    clipped = B @ allocate_pseudo_inverse(wanted, B, LOWER, UPPER)[0]
    assert abs(held[2] - wanted[2]) < 1.5 < 8.0 < abs(clipped[2] - wanted[2])
    assert np.abs(held[3:5]).max() < 0.1


@pytest.mark.parametrize("geometry", [TAROT_T960, OCTOROTOR])
def test_every_attainable_wrench_is_met(geometry: RotorGeometry) -> None:
    rng, matrix = np.random.default_rng(2), control_effectiveness(geometry)
    lower, upper = np.full(geometry.count, LOWER[0]), np.full(geometry.count, UPPER[0])
    for _ in range(50):
        wanted = hover() + rng.uniform(-1.0, 1.0, 6) * [5, 5, 8, 0.5, 0.5, 0.5]
        for thrusts in (
            allocate_sequential(wanted, geometry, lower, upper),
            allocate_px4(wanted, geometry, lower, upper),
            allocate_px4(wanted, geometry, lower, upper, airmode=True),
        ):
            np.testing.assert_allclose(matrix @ thrusts, wanted, atol=1e-9)


def test_an_unreachable_push_gives_way_alone() -> None:
    wanted = hover(45.0)
    got = B @ allocate_sequential(wanted, B, LOWER, UPPER)
    np.testing.assert_allclose(got[2:], wanted[2:], atol=1e-9)
    assert got[0] == pytest.approx(30.383, abs=1e-3)
    # The published order keeps the push and climbs instead, like plain clipping.
    climbing = B @ allocate_px4(wanted, B, LOWER, UPPER)
    clipped = B @ allocate_pseudo_inverse(wanted, B, LOWER, UPPER)[0]
    assert climbing[0] == pytest.approx(wanted[0], abs=8.0)
    assert climbing[2] - wanted[2] < -8.0 and climbing[2] == pytest.approx(clipped[2], abs=0.5)


def test_lateral_force_keeps_its_direction_and_never_turns_round() -> None:
    wanted = hover(30.0, -25.0, 0.0, 2.0, -2.0, 3.0)
    got = B @ allocate_sequential(wanted, B, LOWER, UPPER)
    np.testing.assert_allclose(got[2:], wanted[2:], atol=1e-6)
    kept = got[0] / wanted[0]
    assert 0.0 < kept < 1.0 and got[1] / wanted[1] == pytest.approx(kept, abs=1e-9)
    # Moments beyond reach: the lateral force ends at zero, then yaw gives way, roll stays as long as it can.
    wanted = hover(5.0, 0.0, 0.0, 3.0, 0.0, 40.0)
    got = B @ allocate_sequential(wanted, B, LOWER, UPPER)
    assert got[0] == pytest.approx(0.0, abs=1e-6) and got[3] == pytest.approx(3.0, abs=1e-6)
    assert got[2] == pytest.approx(wanted[2], abs=1e-6) and 0.0 < got[5] < 40.0


def test_order_decides_what_is_lost() -> None:
    wanted = hover(45.0)
    lift_first = B @ allocate_sequential(wanted, B, LOWER, UPPER, order=("vertical",))
    assert lift_first[0] == pytest.approx(45.0, abs=1e-6) and lift_first[2] < wanted[2] - 20.0
    assert FULLY_ACTUATED_ORDER[0] == "lateral"
    with pytest.raises(ValueError, match="unknown axis 'height'"):
        allocate_sequential(wanted, B, LOWER, UPPER, order=("height",))


def test_px4_airmode_buys_moments_with_lift() -> None:
    wanted = hover(0.0, 0.0, 0.0, 3.0, weight=15.0)
    off, on = (B @ allocate_px4(wanted, B, LOWER, UPPER, airmode=mode) for mode in (False, True))
    assert on[3] == pytest.approx(3.0, abs=1e-6) and on[2] < wanted[2] - 3.0
    assert off[3] < 2.8 and off[2] > on[2]


def test_px4_yaw_may_reach_above_the_ceiling_and_lift_pays() -> None:
    upper = np.full(6, 15.0)
    wanted = hover(0.0, 0.0, 0.0, 0.0, 0.0, 8.0)
    got = B @ allocate_px4(wanted, B, LOWER, upper)
    assert got[5] > 0.0 and got[2] > wanted[2] + 1.0


def test_limits_hold_whatever_is_asked() -> None:
    rng = np.random.default_rng(3)
    upper = UPPER.copy()
    upper[2] = 1.2
    for _ in range(200):
        wanted = hover() + rng.uniform(-1.0, 1.0, 6) * [80, 80, 60, 10, 10, 20]
        for thrusts in (allocate_sequential(wanted, B, LOWER, upper), allocate_px4(wanted, B, LOWER, upper)):
            assert np.all(thrusts >= LOWER) and np.all(thrusts <= upper)
