"""Strict priorities: the weighted program without limits, optimal upper levels with limits; flights of the rivals."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from controller_scenes import FLOOR, random_tick
from scipy.optimize import lsq_linear

from ibvs_qp.config import ControllerConfig
from ibvs_qp.controller import HybridController
from sim.evaluate.metrics import compute_metrics
from sim.experiments.design import Choice, design
from sim.experiments.scenes import short_job
from sim.experiments.spec import experiment
from sim.flight.closed_loop import fly
from sim.flight.options import FlightOptions
from sim.rivals import LEXICOGRAPHIC, MPC
from sim.rivals.lexicographic import LEVELS, LexicographicController, row_levels

#: Barriers off: the levels then compete within the thrust window alone.
FREE = dataclasses.replace(ControllerConfig(), barriers=False)
#: Thrusts that limit only some draws, and thrusts that limit many [N].
WIDE, NARROW = (FLOOR, 52.0), (9.0, 12.0)
#: Draws whose two ticks stay within `WIDE`: the row filters carry the thrusts of a limited first tick into the second.
UNLIMITED = (0, 1, 2, 4)
#: Draws whose second tick reaches a bound of `NARROW`.
LIMITED = (1, 2, 3, 4)


def stepped(law: type[HybridController], seed: int, low: float, high: float) -> tuple[HybridController, np.ndarray]:
    """A controller after two ticks near a wall, and their thrusts, (2, 6); the second has the window [low, high]."""
    rng, controller, thrusts = np.random.default_rng(seed), law(FREE), []
    for tick in range(2):
        measurement, reference = random_tick(rng, 2, tick)
        controller.setpoints._rate_step = 1e3
        if tick:
            measurement = dataclasses.replace(measurement, thrust_min=np.full(6, low), thrust_max=np.full(6, high))
        thrusts.append(controller.step(measurement, reference).thrusts)
    return controller, np.array(thrusts)


def reached(thrusts: np.ndarray, low: float, high: float) -> bool:
    """Whether any thrust is at a bound."""
    return bool(((thrusts < low + 1e-3) | (thrusts > high - 1e-3)).any())


def rows(controller: HybridController) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Matrix, target and weight of every task row."""
    flat, targets, weights = controller.engine.data.further
    return flat.reshape(6, -1).T, targets, weights


@pytest.mark.parametrize("seed", UNLIMITED)
def test_without_an_active_limit_both_laws_agree_up_to_smoothness(seed):
    """Six rows fix six thrusts; effort, smoothness and lines that disagree with level flight move both a little."""
    _, weighted = stepped(HybridController, seed, *WIDE)
    _, strict = stepped(LexicographicController, seed, *WIDE)
    assert not reached(weighted, *WIDE) and not reached(strict, *WIDE)
    assert np.abs(weighted - strict).max() < 0.2  # N, of steps of 7 N


@pytest.mark.parametrize("seed", LIMITED)
def test_where_a_limit_is_active_the_first_level_is_as_good_as_alone(seed):
    controller, (_, thrusts) = stepped(LexicographicController, seed, *NARROW)
    data = controller.engine.data
    assert reached(thrusts, *NARROW)
    matrix, targets, weights = rows(controller)
    first = row_levels([row.name for row in controller.problem.task_rows])[0]
    scale = np.sqrt(weights[first])[:, None]
    alone = lsq_linear(scale * matrix[first], scale[:, 0] * targets[first], (data.lower[:6], data.upper[:6]))
    residual = matrix[first] @ thrusts - targets[first]
    assert float(weights[first] @ residual**2) <= 2.0 * alone.cost + 1e-3


@pytest.mark.parametrize("seed", LIMITED)
def test_a_lower_level_takes_what_the_upper_ones_leave(seed):
    """Weighted, the push row pulls at roll and pitch; in strict priorities it does not."""
    strict, (_, at) = stepped(LexicographicController, seed, *NARROW)
    _, (_, mixed) = stepped(HybridController, seed, *NARROW)
    matrix, targets, weights = rows(strict)
    first = row_levels([row.name for row in strict.problem.task_rows])[0]
    cost = [float(weights[first] @ (matrix[first] @ thrusts - targets[first]) ** 2) for thrusts in (at, mixed)]
    assert cost[0] <= cost[1] + 1e-3


def test_every_row_has_one_level_and_the_angles_the_last():
    names = ["line_0", "line_0_angle", "push", "standoff", "roll", "pitch", "yaw", "velocity_right", "height", "mine"]
    found = [{names[index] for index in level} for level in row_levels(names)]
    assert found == [
        {"roll", "pitch"},
        {"yaw"},
        {"line_0", "velocity_right", "height"},
        {"push", "standoff"},
        {"line_0_angle", "mine"},
    ]
    assert len(found) == len(LEVELS)


@pytest.mark.slow
@pytest.mark.parametrize("rival", [LEXICOGRAPHIC, MPC])
def test_a_rival_paints(rival):
    options = FlightOptions(controller=rival, features="geometric", video=False, compiled=True)
    trace = fly(short_job(0.4, rows=1), options)
    assert trace.claimed, trace.reason
    figures = compute_metrics(trace)
    assert figures["path_rms_straight_m"] < 3e-3
    assert figures["force_rms_straight_n"] < 0.6
    assert figures["contact_share"] > 0.99
    assert figures["outcomes"]["analytic_fallback"] == 0


def test_the_experiment_flies_all_three_on_the_same_seeds():
    runs = design(experiment("rivals"), Choice())
    cells: dict[str, dict[str, set[int]]] = {}
    for run in runs:
        assert run.plan.options.controller == {"lexicographic": LEXICOGRAPHIC, "mpc": MPC}.get(run.variant, "")
        assert run.plan.config.controller.reach_check != (run.params["kind"] == "35 N")
        cells.setdefault(str(run.params), {}).setdefault(run.plan.options.controller, set()).add(run.seed)
    assert len(cells) == 5
    for cell in cells.values():
        assert set(cell) == {"", LEXICOGRAPHIC, MPC}
        assert all(seeds == set(range(10)) for seeds in cell.values())
