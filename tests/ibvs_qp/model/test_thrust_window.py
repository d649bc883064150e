"""Thrusts of a tick: window and rate whatever limits are reported, hover without a solution, a full inertia."""

from __future__ import annotations

import dataclasses
import re
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from controller_scenes import CEILING, FLOOR, attitude, measured, without_rotors
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from small_vehicle import SmallVehicle

from allocation import control_effectiveness
from ibvs_qp.analytic import PaperController
from ibvs_qp.config import ControllerConfig
from ibvs_qp.config.errors import ConfigError
from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.controller import HybridController
from ibvs_qp.measurement import Reference
from ibvs_qp.model.hover import hold_thrusts, hover_gains
from ibvs_qp.model.motion_margin import TICKS_LATE, MotionLoop
from ibvs_qp.model.reach import LEAST_GAP, thrust_window
from ibvs_qp.model.reporting import clip

BOX = np.full(1, FLOOR), np.full(1, CEILING)
STEP = 2.0
LIMIT = st.floats(-100.0, 200.0)


@settings(max_examples=300, deadline=None)
@given(st.floats(FLOOR, CEILING), LIMIT, LIMIT)
def test_the_window_lies_within_box_and_rate(last: float, lower: float, upper: float) -> None:
    low, high = thrust_window(np.full(1, last), np.full(1, lower), np.full(1, upper), STEP, *BOX)
    assert low[0] >= FLOOR and high[0] <= CEILING and low[0] < high[0]
    assert low[0] >= last - STEP - LEAST_GAP and high[0] <= last + STEP + LEAST_GAP


@pytest.mark.parametrize(
    ("lower", "upper", "window"),
    [
        (FLOOR, CEILING, (18.0, 22.0)),
        (19.0, 21.0, (19.0, 21.0)),
        (FLOOR, 5.0, (18.0, 18.0)),
        (40.0, CEILING, (22.0, 22.0)),
    ],
)
def test_a_limit_out_of_reach_is_approached_at_the_rate(
    lower: float, upper: float, window: tuple[float, float]
) -> None:
    found = thrust_window(np.full(1, 20.0), np.full(1, lower), np.full(1, upper), STEP, *BOX)
    assert [side.item() for side in found] == pytest.approx(window, abs=2.0 * LEAST_GAP)


def test_thrusts_are_clipped_on_both_sides() -> None:
    window = SimpleNamespace(lower=np.full(4, 2.0), upper=np.full(4, 9.0))
    found = clip(window, np.array([-5.0, 1.9, 2.5, 100.0]))  # type: ignore[arg-type]
    assert found.tolist() == [2.0, 2.0, 2.5, 9.0]


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


PRODUCTS = (0.03, -0.05, 0.02)
DIAGONAL, FULL = (
    # A row filter would start at the turn that the last thrusts give, and that one does depend on the inertia.
    without_rotors(ControllerConfig(vehicle=VehicleParams(inertia_products_kg_m2=products)))
    for products in ((0.0, 0.0, 0.0), PRODUCTS)
)


def turn(law: Any, config: ControllerConfig) -> np.ndarray:
    """Angular acceleration [rad/s^2] that the first thrusts of a tilted, turning vehicle give."""
    vehicle = SmallVehicle(config)
    vehicle.attitude, vehicle.omega = Rotation.from_euler("xyz", (0.04, -0.03, 0.02)), np.array([0.1, -0.2, 0.15])
    if law is hold_thrusts:
        vehicle.omega = np.zeros(3)
        thrusts = hold_thrusts(config, vehicle.measure())
    else:
        thrusts = law(config).step(vehicle.measure(), Reference(standoff=0.5)).thrusts
    momentum = config.vehicle.inertia @ vehicle.omega
    moment = (vehicle.matrix @ thrusts)[3:] - np.cross(vehicle.omega, momentum)
    return np.linalg.solve(config.vehicle.inertia, moment)


@pytest.mark.parametrize("law", [HybridController, PaperController, hold_thrusts])
def test_the_achieved_turn_does_not_depend_on_the_inertia(law: Any) -> None:
    expected = turn(law, DIAGONAL)
    assert np.abs(expected).max() > 0.5
    np.testing.assert_allclose(turn(law, FULL), expected, atol=2e-3)


def test_products_that_no_rigid_body_has_are_refused() -> None:
    message = "inertia_kg_m2 = (0.22, 0.3, 0.48) kg m^2 with the products (0.3, 0.0, 0.0) is refused"
    with pytest.raises(ConfigError, match=re.escape(message)):
        VehicleParams(inertia_products_kg_m2=(0.3, 0.0, 0.0))
    with pytest.raises(ConfigError, match="no rigid body"):
        VehicleParams(inertia_kg_m2=(0.1, 0.1, 0.3))
