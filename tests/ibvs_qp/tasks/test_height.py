"""Height row: its target is that of lines and velocity; its weight decides what a limited tick gives up."""

from __future__ import annotations

import math

import numpy as np
import pytest
from controller_scenes import pack, random_tick

from allocation import control_effectiveness
from ibvs_qp.config import ControllerConfig
from ibvs_qp.controller import HybridController
from ibvs_qp.model.setpoints import Setpoints
from ibvs_qp.vision import endpoint_line_row, line_interaction_matrix


def height_target(config: ControllerConfig, seed: int, lines: int, share: float) -> tuple[float, float, Setpoints]:
    """Target and weight of the row on a random tick, and the setpoints of that tick."""
    controller = HybridController(config)
    pack(controller, *random_tick(np.random.default_rng(seed), lines), share=share)
    data, rows = controller.engine.data, controller.problem.task_rows
    _, targets, weights = controller.problem.report(data.point, np.zeros(6))
    place = [row.name for row in rows].index("height")
    return float(targets[place]), float(weights[place]), controller.setpoints


def last_motion(config: ControllerConfig, setpoints: Setpoints) -> np.ndarray:
    """Acceleration that the last thrusts command, by Newton and Euler, (6,)."""
    vehicle = config.vehicle
    wrench = control_effectiveness(vehicle.geometry) @ setpoints.last + setpoints.bias_wrench
    return wrench / np.array([vehicle.mass_kg] * 3 + list(vehicle.inertia_kg_m2))


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("share", [0.0, 1.0])
def test_a_level_line_and_the_row_want_the_same(seed: int, share: float) -> None:
    """Behind the filter of line rows; their lead has no motor's thrust on the first tick."""
    config = ControllerConfig()
    target, weight, setpoints = height_target(config, seed, 1, share)
    (line,) = setpoints.lines
    turned = 1.0 - share * (1.0 - config.gains.body_rotation_gain)
    sideways = setpoints.free[0] * setpoints.velocity_command[0]
    twist = np.concatenate((target * setpoints.down + sideways * setpoints.right, turned * setpoints.angular))
    image = line_interaction_matrix(line.rho, line.theta, setpoints.plane)
    gains = config.gains
    wanted = -(gains.line_kp * line.error + gains.line_kd * line.rate + gains.line_ki * line.integral)
    assert line.matrix.shape == image.shape
    row = endpoint_line_row(line.matrix, line.theta, line.tip)
    last = last_motion(config, setpoints)
    last[:3] -= setpoints.normal * (setpoints.normal @ last[:3])
    last[3:] *= turned
    wanted += math.exp(-config.tick_s / gains.line_filter_s) * (row @ last - wanted)
    assert line.weight == pytest.approx(1.0) and setpoints.free[1] == pytest.approx(0.0)
    assert row @ twist == pytest.approx(wanted, abs=1e-9)
    assert weight == config.weights.height


def test_without_a_line_it_is_the_velocity_law() -> None:
    target, _, setpoints = height_target(ControllerConfig(), 3, 0, 0.0)
    assert target == pytest.approx(setpoints.velocity_command[1], abs=1e-12)


def test_the_published_law_has_no_such_row() -> None:
    controller = HybridController(ControllerConfig(line_profile="paper"))
    assert "height" not in {row.name for row in controller.problem.task_rows}
