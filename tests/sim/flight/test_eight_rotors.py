"""Eight tilted rotors through the same controller, estimators, plant and reach: nothing counts on six."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from closed_loop_rigs import short_scene
from reach_oracle import OCTOROTOR
from scipy.linalg import null_space
from scipy.optimize import linprog
from small_vehicle import SmallVehicle

import ibvs_qp
from allocation import control_effectiveness, push_reach
from ibvs_qp.config import ControllerConfig
from ibvs_qp.config.gains import Weights
from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.controller import HybridController
from ibvs_qp.measurement import Reference
from sim.evaluate.metrics import compute_metrics
from sim.flight.closed_loop import fly
from sim.flight.options import FlightOptions

#: Thrust of a 13 inch propeller's motor [N].
FULL = 35.0
VEHICLE = VehicleParams(geometry=OCTOROTOR, thrust_max_n=FULL, propeller_radius_m=0.165)


@pytest.mark.slow
@pytest.mark.parametrize("law", ["qp", "paper"])
def test_paints_in_the_closed_loop(law: str) -> None:
    preset = ibvs_qp.preset(law)
    config = dataclasses.replace(preset, controller=dataclasses.replace(preset.controller, vehicle=VEHICLE))
    scene = short_scene(stroke_m=0.3, rows=1)
    trace = fly(scene, FlightOptions(law=law, features="geometric", video=False), config=config)
    metrics = compute_metrics(trace)
    assert trace.claimed, trace.reason
    assert trace.thrusts.shape[1] == 8
    assert metrics["force_rms_straight_n"] <= 0.35 and metrics["contact_share"] >= 0.99
    assert metrics["path_rms_straight_m"] <= 0.005 and metrics["tilt_peak_deg"] <= 3.0
    if law == "qp":
        assert metrics["outcomes"]["solved"] >= 0.995 * len(trace.t)


def margin(thrusts: np.ndarray, low: np.ndarray, high: np.ndarray) -> float:
    """Least distance of a rotor from a limit [N]."""
    return float(np.minimum(thrusts - low, high - thrusts).min())


@pytest.mark.slow
@pytest.mark.parametrize(("push", "lost"), [(10.0, None), (18.0, None), (6.0, 5)])
def test_redundant_thrusts_keep_away_from_the_limits(push: float, lost: int | None) -> None:
    """Of the largest margin of this wrench they leave 15 %; a rotor that is nearly lost keeps between its limits."""
    low, high, matrix = VEHICLE.thrust_min.copy(), np.full(8, FULL), control_effectiveness(OCTOROTOR)
    if lost is not None:
        high[lost] = low[lost] + 1.0
    vehicles = {}
    for weight in (0.0, ControllerConfig().weights.margin):
        config = ControllerConfig(vehicle=VEHICLE, weights=Weights(margin=weight))
        vehicles[weight] = press(HybridController(config), push, high, 1000)
    without, vehicle = vehicles.values()
    np.testing.assert_allclose(matrix @ vehicle.thrusts, matrix @ without.thrusts, atol=0.1)
    basis = null_space(matrix)
    rows = np.hstack((np.vstack((-basis, basis)), np.ones((16, 1))))
    least = np.linalg.pinv(matrix) @ (matrix @ vehicle.thrusts)
    best = linprog((0, 0, -1), A_ub=rows, b_ub=np.concatenate((least - low, high - least)), bounds=(None, None)).x[2]
    assert margin(vehicle.thrusts, low, high) > 0.85 * best
    assert margin(vehicle.thrusts, low, high) > 1.2 * margin(least, low, high)


def press(controller: HybridController, push: float, limit: np.ndarray, ticks: int) -> SmallVehicle:
    vehicle = SmallVehicle(controller.config, distance=0.02)
    for _ in range(ticks):
        command = controller.step(
            vehicle.measure(count=0, thrust_max=limit), Reference(push_force=push, standoff=0.1, contact=True)
        )
        assert command.thrusts.shape == (8,) and np.all(command.thrusts <= FULL)
        vehicle.fly(command.thrusts)
    assert command.outcome == "solved" and command.rejected == ()
    return vehicle


def test_holds_a_push_with_one_rotor_idle() -> None:
    """Where a hexarotor loses its hover, the redundant pair carries on, as the reach predicts."""
    limit = np.full(8, FULL)
    limit[0] = VEHICLE.thrust_min[0]
    assert push_reach(OCTOROTOR, 6.0 * 9.81, np.array([0.7, 0.0, 0.0]), 1.2, limit).push > 10.0
    vehicle = press(HybridController(ControllerConfig(vehicle=VEHICLE)), 8.0, limit, 1500)
    assert -vehicle.contact[0] == pytest.approx(8.0, abs=0.3)
    roll, pitch, _ = vehicle.attitude.as_euler("xyz", degrees=True)
    assert abs(roll) <= 1.0 and abs(pitch) <= 1.0
    assert abs(vehicle.position[2]) <= 0.05
    assert vehicle.thrusts[0] == pytest.approx(1.2, abs=0.01)
