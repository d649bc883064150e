"""Hover without a solution: the weight is carried and a tilt is opposed, within the thrust limits."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from controller_scenes import CEILING, FLOOR, attitude, measured

from allocation import control_effectiveness
from ibvs_qp.config import ControllerConfig
from ibvs_qp.model.hover import hold_thrusts, hover_gains
from ibvs_qp.model.motion_margin import TICKS_LATE, MotionLoop

CONFIG = ControllerConfig()
MATRIX = control_effectiveness(CONFIG.vehicle.geometry)


@pytest.mark.parametrize("seen", [None, measured(0, attitude=attitude(), angular_velocity=np.zeros(3))])
def test_at_rest_it_is_a_level_hover(seen: object) -> None:
    wrench = MATRIX @ hold_thrusts(CONFIG, seen)  # type: ignore[arg-type]
    np.testing.assert_allclose(wrench, [0, 0, -9.81 * CONFIG.vehicle.mass_kg, 0, 0, 0], atol=1e-9)


def test_tilt_and_rates_are_opposed() -> None:
    turning = np.array([0.1, -0.2, 0.3])
    wrench = MATRIX @ hold_thrusts(CONFIG, measured(0, attitude=attitude(0.05, -0.05), angular_velocity=turning))
    assert wrench[3] < 0.0 < wrench[4] and wrench[5] < 0.0


@pytest.mark.parametrize("axis", range(3))
def test_a_turn_alone_is_opposed(axis: int) -> None:
    turning = 0.3 * np.eye(3)[axis]
    moment = (MATRIX @ hold_thrusts(CONFIG, measured(0, attitude=attitude(), angular_velocity=turning)))[3:]
    assert moment[axis] < -1e-3 and np.abs(np.delete(moment, axis)).max() < 1e-9


def test_thrusts_stay_within_their_limits() -> None:
    thrusts = hold_thrusts(CONFIG, measured(0, attitude=attitude(2.0), angular_velocity=np.full(3, 30.0)))
    assert (thrusts >= FLOOR).all() and (thrusts <= CEILING).all()


@pytest.mark.parametrize(("lag_ratio", "bound"), [(0.75, 2.0), (1.0, 2.0), (1.6, 2.5)])
@pytest.mark.parametrize("lag_s", [0.01, 0.0575, 0.3])
def test_the_loop_of_the_hover_is_robust_without_leads_and_filters(
    lag_ratio: float, bound: float, lag_s: float
) -> None:
    vehicle = dataclasses.replace(CONFIG.vehicle, motor_lag_up_s=lag_s, motor_lag_down_s=lag_s)
    kp, kd = hover_gains(dataclasses.replace(CONFIG, vehicle=vehicle))
    loop = MotionLoop(kp=kp, kd=kd, lag=lag_s, delay=TICKS_LATE * CONFIG.tick_s, lag_ratio=lag_ratio)
    assert loop.sensitivity_peak < bound
