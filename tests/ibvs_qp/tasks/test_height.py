"""Height row: it wishes what lines and velocity already wish, and its weight decides who pays on a limited tick."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from controller_scenes import random_tick

from ibvs_qp.config import ControllerConfig
from ibvs_qp.model.equations import setpoint_model
from ibvs_qp.model.height import height_wish
from ibvs_qp.model.signals import stack
from ibvs_qp.model.step_function import Setpoints
from ibvs_qp.vision import endpoint_line_row, line_interaction_matrix


def wished(config: ControllerConfig, seed: int, lines: int, share: float) -> tuple[np.ndarray, Setpoints]:
    """(target, weight) of the row on a random tick, and the set-points of that tick."""
    signals = setpoint_model(config)
    function = ca.Function("height", [stack(signals.inputs), stack(signals.states)], [height_wish(signals, config)])
    terms = Setpoints(config)
    states = np.concatenate([value.copy() for value in terms.tick.states.values()])
    terms.update(*random_tick(np.random.default_rng(seed), lines))
    terms.contact_weight = share
    inputs = np.concatenate([terms.tick.inputs[name] for name in signals.inputs])
    return np.array(function(inputs, states)).ravel(), terms


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("share", [0.0, 1.0])
def test_a_level_line_and_the_row_want_the_same(seed: int, share: float) -> None:
    config = ControllerConfig()
    (target, weight), terms = wished(config, seed, 1, share)
    (line,) = terms.lines
    turned = 1.0 - share * (1.0 - config.gains.line_turn_share)
    sideways = terms.free_right * terms.velocity_command[0]
    twist = np.concatenate((target * terms.down + sideways * terms.right, turned * terms.angular))
    image = line_interaction_matrix(line.rho, line.theta, terms.plane)
    gains = config.gains
    wanted = -(gains.line_kp * line.error + gains.line_kd * line.error_rate + gains.line_ki * line.integral)
    row = endpoint_line_row(image, line.theta, (line.tip_x, line.tip_y)) @ line.twist_map
    assert line.weight == pytest.approx(1.0) and terms.free_down == pytest.approx(0.0)
    assert row @ twist == pytest.approx(wanted, abs=1e-9)
    assert weight == config.weights.height


def test_without_a_line_it_is_the_velocity_law() -> None:
    (target, _), terms = wished(ControllerConfig(), 3, 0, 0.0)
    assert target == pytest.approx(terms.velocity_command[1], abs=1e-12)


def test_the_published_law_has_no_such_row() -> None:
    (_, weight), _ = wished(ControllerConfig(line_profile="paper"), 1, 1, 0.0)
    assert weight == 0.0
