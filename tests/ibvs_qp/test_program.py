"""The program of a tick with its names, and weights, bounds and switches that change by name between steps."""

from __future__ import annotations

import math
import time
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from c_library import COMPILERS
from controller_scenes import measured, random_tick

from ibvs_qp.command import Command
from ibvs_qp.config import ControllerConfig, Gains, LimitSettings, Weights
from ibvs_qp.config.errors import ConfigError
from ibvs_qp.controller import HybridController
from ibvs_qp.model.model import Model
from ibvs_qp.model.rows import Parameter, TaskRow
from ibvs_qp.symbolic import machine_code
from ibvs_qp.tasks import Task

BACKENDS = ["python", *(["compiled"] if COMPILERS else [])]
MATRICES = ("P", "q", "A", "lower", "upper", "weights")


@pytest.fixture(autouse=True)
def patient(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(machine_code, "PATIENCE_S", 300.0)  # on a busy machine


def ticks(count: int) -> list[Any]:
    rng = np.random.default_rng(0)
    return [random_tick(rng, 2, tick) for tick in range(count)]


def same(one: Command, other: Command) -> None:
    np.testing.assert_array_equal(one.thrusts, other.thrusts)
    assert (one.outcome, one.active_limits, one.iterations) == (other.outcome, other.active_limits, other.iterations)


@pytest.mark.parametrize("backend", BACKENDS)
def test_the_program_of_the_last_step_has_its_solution_and_names(backend: str) -> None:
    controller = HybridController(ControllerConfig().on_backend(backend))
    for tick in ticks(3):
        command = controller.step(*tick)
    program, (x, y) = controller.program(), _solution(controller)
    assert np.abs(program.P @ x + program.q + program.A.T @ y).max() < 1e-4
    assert (program.A @ x <= program.upper + 1e-5).all() and (program.A @ x >= program.lower - 1e-5).all()
    np.testing.assert_allclose(x[:6], command.thrusts, atol=1e-5)
    assert program.A.shape == (len(program.limits), len(program.variables)) and len(program.variables) == len(x)
    reports = {task.name: task.weight for task in command.tasks}
    assert reports == {name: weight for name, weight in zip(program.tasks, program.weights, strict=True) if weight}
    assert {"push", "roll", "line_0"} <= set(program.tasks) and {"yaw", "push_ceiling"} <= set(program.limits)
    assert program.variables[6:] == tuple(f"slack_{name}" for name in program.limits[6:])


def _solution(controller: HybridController) -> tuple[np.ndarray, np.ndarray]:
    data = controller.engine.data
    found = controller.engine.exact.solve(data.p, data.q, data.a, data.lower, data.upper)
    assert found is not None
    return found.x, found.y


@pytest.mark.parametrize("backend", BACKENDS)
def test_the_program_of_another_measurement_is_that_of_the_next_step_and_leaves_no_trace(backend: str) -> None:
    config, (*first, given, last) = ControllerConfig().on_backend(backend), ticks(12)
    asked, other = HybridController(config), HybridController(config)
    for tick in first:
        same(asked.step(*tick), other.step(*tick))
    before, ahead, after = asked.program(), asked.program(*given), asked.program()
    for tick in (given, last):
        same(asked.step(*tick), other.step(*tick))
        if tick is given:
            following = asked.program()
    for name in MATRICES:
        np.testing.assert_array_equal(getattr(after, name), getattr(before, name))
        np.testing.assert_array_equal(getattr(following, name), getattr(ahead, name))
    with pytest.raises(ConfigError, match="the measurement is refused: attitude"):
        HybridController(config).program(replace(measured(0), attitude=np.full(4, math.nan)))


WEIGHTS = {"push": 0.2, "level": 100.0, "line": 0.0, "velocity": 30.0, "line_sigma": 0.05, "smoothness": 0.0}
LIMITS = {"tilt_deg": 3.0, "push_slack_weight": 10.0, "thrust_noise_n": 0.0, "yaw_rate_1_s": 9.0, "view_up": -0.1}
GAINS = {"attitude_kp": 60.0, "force_kfi": 0.0}


@pytest.mark.parametrize("backend", BACKENDS)
def test_settings_changed_in_flight_are_those_of_a_controller_built_with_them(backend: str) -> None:
    shipped = ControllerConfig().on_backend(backend)
    built = replace(shipped, weights=Weights(**WEIGHTS), limits=LimitSettings(**LIMITS), gains=Gains(**GAINS))
    changed, fresh = HybridController(shipped), HybridController(built)
    values = {"weights": WEIGHTS, "limits": LIMITS, "gains": GAINS}
    changed.adjust({f"{section}.{name}": value for section, each in values.items() for name, value in each.items()})
    assert changed.config == built
    for tick in ticks(20):
        same(changed.step(*tick), fresh.step(*tick))
    changed.reset()
    fresh.reset()
    same(changed.step(*ticks(1)[0]), fresh.step(*ticks(1)[0]))
    assert changed.program().A.shape == HybridController(shipped).program().A.shape


@pytest.mark.parametrize("backend", BACKENDS)
def test_rows_switched_off_have_no_weight_and_no_bound(backend: str) -> None:
    controller = HybridController(ControllerConfig().on_backend(backend))
    controller.step(*ticks(1)[0])
    before, pattern = controller.program(), controller.problem.a_pattern.nnz
    controller.adjust({"weights.yaw": 0.0, "limits.yaw_barrier": False, "limits.tilt_barrier": False})
    off = controller.program(*ticks(2)[1])
    yaw, rows = off.tasks.index("yaw"), [off.limits.index(name) for name in ("yaw", "tilt_roll", "tilt_pitch")]
    assert before.weights[yaw] > 0.0 and off.weights[yaw] == 0.0
    assert (off.upper[rows] - off.lower[rows] > 1e4).all() and (before.upper[rows] - before.lower[rows] < 1e4).all()
    assert controller.problem.a_pattern.nnz == pattern
    controller.reset()
    without = HybridController(replace(controller.config, limits=replace(controller.config.limits)))
    for tick in ticks(10):
        np.testing.assert_allclose(controller.step(*tick).thrusts, without.step(*tick).thrusts, atol=1e-3)
    with pytest.raises(ConfigError, match=r"limits.yaw_barrier = True is refused: the program has no rows"):
        without.adjust({"limits.yaw_barrier": True})
    controller.adjust({"weights.yaw": 400.0, "limits.yaw_barrier": True, "limits.tilt_barrier": True})
    controller.reset()
    same(controller.step(*ticks(1)[0]), HybridController(ControllerConfig().on_backend(backend)).step(*ticks(1)[0]))


class QuietRotor(Task):
    """One row whose target and weight are parameters."""

    def __init__(self) -> None:
        self._target, self._weight = Parameter("quiet_thrust", 4.0), Parameter("quiet_weight", 0.0)

    def rows(self, model: Model) -> list[TaskRow]:
        """One row in newtons."""
        target, weight = model.parameter(self._target), model.parameter(self._weight)
        return [TaskRow(name="quiet", unit="N", expression=model.thrust[0], target=target, weight=weight)]


def test_parameters_of_an_own_task_have_names_too() -> None:
    controller, plain = HybridController(tasks=[QuietRotor()]), HybridController()
    tick = ticks(1)[0]
    np.testing.assert_allclose(controller.step(*tick).thrusts, plain.step(*tick).thrusts, atol=1e-9)
    controller.reset()
    controller.adjust({"quiet_weight": 1e3, "quiet_thrust": 6.0})
    assert controller.step(*tick).thrusts[0] == pytest.approx(6.0, abs=0.1)
    assert "quiet" not in HybridController().program().tasks


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        (
            "weights.pusch",
            1.0,
            "weights.pusch = 1.0 is refused: it cannot .*; did you mean 'weights.push'",
        ),
        ("tick_s", 0.002, "tick_s = 0.002 is refused: it cannot change"),
        ("limits.trim_deg", 1.0, "limits.trim_deg = 1.0 is refused: it cannot change"),
        ("weights.push", -1.0, r"weights.push = -1.0 1/N\^2 is refused: allowed is"),
        ("weights.push", math.nan, "weights.push = nan"),
        ("weights.effort", 0.0, "weights.effort = 0.0"),
        ("gains.line_kp", "12", "gains.line_kp = '12' is refused: a float is needed"),
        ("limits.tilt_barrier", 3, "limits.tilt_barrier = 3 is refused: a bool is needed"),
        ("limits.view_up", 5.0, "limits.view_up = 5.0 .*must lie below view_down"),
        ("quiet_thrust", math.inf, "quiet_thrust = inf is refused: 1 finite numbers are needed"),
        ("quiet_thrust", (1.0, 2.0), "quiet_thrust = "),
    ],
)
def test_bad_names_and_values_are_refused_and_change_nothing(name: str, value: Any, words: str) -> None:
    controller = HybridController(tasks=[QuietRotor()])
    config, tick = controller.config, ticks(1)[0]
    expected = controller.step(*tick)
    with pytest.raises(ConfigError, match=words):
        controller.adjust({"weights.level": 1.0, name: value})
    controller.reset()
    assert controller.config is config
    same(controller.step(*tick), expected)


def test_controllers_that_share_their_equations_share_nothing_else() -> None:
    """Controllers of other settings fly in turn as each does alone; names declared in one are unknown to the next."""
    configs = [
        ControllerConfig(),
        replace(ControllerConfig(), weights=Weights(push=0.1), gains=Gains(attitude_kp=50.0)),
        replace(ControllerConfig(), limits=LimitSettings(tilt_deg=5.0)),
    ]
    alone = [[controller.step(*tick) for tick in ticks(15)] for controller in map(HybridController, configs)]
    together = list(map(HybridController, configs))
    together[0].problem.model.parameter(Parameter("own", 1.0))
    together[0].problem.model.output("own", together[0].problem.model.contact_weight)
    for place, tick in enumerate(ticks(15)):
        for controller, commands in zip(together, alone, strict=True):
            same(controller.step(*tick), commands[place])
    later = HybridController()
    assert "own" not in later.setpoints.step.sensed and "own" not in later.setpoints.step.outputs
    assert [controller.problem.model.config for controller in together] == configs


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_further_controller_costs_less_than_30_ms(backend: str) -> None:
    config, times = ControllerConfig().on_backend(backend), []
    HybridController(config)
    for weight in (0.1, 0.2, 0.3, 0.4, 0.5):
        began = time.process_time()
        HybridController(replace(config, weights=Weights(push=weight)))
        times.append(time.process_time() - began)
    assert np.median(times) < 0.03
