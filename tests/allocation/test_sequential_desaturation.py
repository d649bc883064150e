"""Sequential desaturation: exact where nothing saturates, the published order's flaw, and the order that mends it."""

from __future__ import annotations

import numpy as np
import pytest
from rotor_layouts import OCTOROTOR

from allocation import (
    FULLY_ACTUATED_ORDER,
    TAROT_T960,
    allocate_pseudo_inverse,
    allocate_px4,
    allocate_sequential,
    control_effectiveness,
    hover_wrench,
)

B = control_effectiveness(TAROT_T960)
LOWER, UPPER = np.full(6, 1.2), np.full(6, 52.56)
HOVER = hover_wrench(6.0 * 9.81)


@pytest.mark.parametrize("geometry", [TAROT_T960, OCTOROTOR])
def test_every_attainable_wrench_is_met(geometry) -> None:
    rng, matrix = np.random.default_rng(2), control_effectiveness(geometry)
    lower, upper = np.full(geometry.count, 1.2), np.full(geometry.count, 52.56)
    for _ in range(50):
        wanted = HOVER + rng.uniform(-1.0, 1.0, 6) * [5, 5, 8, 0.5, 0.5, 0.5]
        for thrusts in (
            allocate_sequential(wanted, geometry, lower, upper),
            allocate_px4(wanted, geometry, lower, upper),
            allocate_px4(wanted, geometry, lower, upper, airmode=True),
        ):
            np.testing.assert_allclose(matrix @ thrusts, wanted, atol=1e-9)


def test_an_unreachable_push_gives_way_alone() -> None:
    wanted = HOVER + np.array([45.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    got = B @ allocate_sequential(wanted, B, LOWER, UPPER)
    np.testing.assert_allclose(got[2:], wanted[2:], atol=1e-9)
    assert got[0] == pytest.approx(30.383, abs=1e-3)
    # The published order keeps the push and climbs instead, like plain clipping.
    climbing = B @ allocate_px4(wanted, B, LOWER, UPPER)
    clipped = B @ allocate_pseudo_inverse(wanted, B, LOWER, UPPER)[0]
    assert climbing[0] == pytest.approx(wanted[0], abs=8.0)
    assert climbing[2] - wanted[2] < -8.0 and climbing[2] == pytest.approx(clipped[2], abs=0.5)


def test_lateral_force_keeps_its_direction_and_never_turns_round() -> None:
    wanted = HOVER + np.array([30.0, -25.0, 0.0, 2.0, -2.0, 3.0])
    got = B @ allocate_sequential(wanted, B, LOWER, UPPER)
    np.testing.assert_allclose(got[2:], wanted[2:], atol=1e-6)
    share = got[0] / wanted[0]
    assert 0.0 < share < 1.0 and got[1] / wanted[1] == pytest.approx(share, abs=1e-9)
    # Moments beyond reach: the lateral wish ends at zero, then yaw gives way, roll stays as long as it can.
    wanted = HOVER + np.array([5.0, 0.0, 0.0, 3.0, 0.0, 40.0])
    got = B @ allocate_sequential(wanted, B, LOWER, UPPER)
    assert got[0] == pytest.approx(0.0, abs=1e-6) and got[3] == pytest.approx(3.0, abs=1e-6)
    assert got[2] == pytest.approx(wanted[2], abs=1e-6) and 0.0 < got[5] < 40.0


def test_order_decides_what_is_lost() -> None:
    wanted = HOVER + np.array([45.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    lift_first = B @ allocate_sequential(wanted, B, LOWER, UPPER, order=("vertical",))
    assert lift_first[0] == pytest.approx(45.0, abs=1e-6) and lift_first[2] < wanted[2] - 20.0
    assert FULLY_ACTUATED_ORDER[0] == "lateral"
    with pytest.raises(ValueError, match="unknown axis 'height'"):
        allocate_sequential(wanted, B, LOWER, UPPER, order=("height",))


def test_px4_airmode_buys_moments_with_lift() -> None:
    wanted = hover_wrench(15.0) + np.array([0.0, 0.0, 0.0, 3.0, 0.0, 0.0])
    off, on = (B @ allocate_px4(wanted, B, LOWER, UPPER, airmode=mode) for mode in (False, True))
    assert on[3] == pytest.approx(3.0, abs=1e-6) and on[2] < wanted[2] - 3.0
    assert off[3] < 2.8 and off[2] > on[2]


def test_px4_yaw_may_reach_above_the_ceiling_and_lift_pays() -> None:
    upper = np.full(6, 15.0)
    wanted = hover_wrench(6.0 * 9.81) + np.array([0.0, 0.0, 0.0, 0.0, 0.0, 8.0])
    got = B @ allocate_px4(wanted, B, LOWER, upper)
    assert got[5] > 0.0 and got[2] > wanted[2] + 1.0


def test_limits_hold_whatever_is_asked() -> None:
    rng = np.random.default_rng(3)
    upper = UPPER.copy()
    upper[2] = 1.2
    for _ in range(200):
        wanted = HOVER + rng.uniform(-1.0, 1.0, 6) * [80, 80, 60, 10, 10, 20]
        for thrusts in (allocate_sequential(wanted, B, LOWER, upper), allocate_px4(wanted, B, LOWER, upper)):
            assert np.all(thrusts >= LOWER) and np.all(thrusts <= upper)
