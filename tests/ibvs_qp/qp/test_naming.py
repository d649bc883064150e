"""Whatever keeps the program from being solved is named: numbers that are none, crossed bounds, rows of one name."""

from __future__ import annotations

import math

import casadi as ca
import numpy as np
import pytest
from controller_scenes import dense, line_references, measured

from ibvs_qp.command import Command, Outcome
from ibvs_qp.config import ControllerConfig, SolverSettings
from ibvs_qp.config.errors import ConfigError
from ibvs_qp.controller import HybridController
from ibvs_qp.limits import Limit
from ibvs_qp.measurement import Reference
from ibvs_qp.model.model import Model
from ibvs_qp.model.rows import LimitRow, TaskRow
from ibvs_qp.tasks import Task

#: The program flies again at the first good solution.
AT_ONCE = ControllerConfig(solver=SolverSettings(recovery_ticks=0))


class LiftTask(Task):
    """One row on the first rotor; the parameter "lift" holds target and weight."""

    def __init__(self, target_over: bool = False) -> None:
        self.target_over = target_over

    def rows(self, model: Model) -> list[TaskRow]:
        """One row in newtons; on demand its target is divided by the parameter."""
        lift = model.signals.input("lift", 2)
        target = 1.0 / lift[0] if self.target_over else lift[0]
        return [TaskRow(name="lift", unit="N", expression=model.thrust[0], target=target, weight=lift[1])]


class ClimbLimit(Limit):
    """Vertical acceleration between the two entries of the parameter "climb"."""

    def rows(self, model: Model) -> list[LimitRow]:
        """One soft row in m/s^2."""
        climb = model.signals.input("climb", 2)
        up = -model.acceleration[2]
        return [LimitRow(name="climb", unit="m/s^2", expression=up, lower=climb[0], upper=climb[1], slack_weight=10.0)]


def step(controller: HybridController, tick: int, **inputs: tuple[float, ...]) -> Command:
    """One tick with the parameters of tasks and limits of one's own."""
    for name, values in inputs.items():
        controller.setpoints.step.sensed[name][:] = values
    command = controller.step(measured(tick), Reference(lines=line_references(2)))
    assert np.isfinite(command.thrusts).all()
    return command


# ------------------------------------------------------------------------------------------------- no silent fallback


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("place", [0, 1])
def test_a_parameter_that_is_no_number_is_named(value: float, place: int) -> None:
    controller = HybridController(AT_ONCE, tasks=[LiftTask()])
    assert step(controller, 0, lift=(10.0, 0.1)).rejected == ()
    broken = [10.0, 0.1]
    broken[place] = value
    command = step(controller, 1, lift=tuple(broken))
    assert command.outcome is Outcome.ANALYTIC_FALLBACK
    (said,) = command.rejected
    assert said.startswith("input lift: ") and "not finite" in said
    after = step(controller, 2, lift=(10.0, 0.1))
    assert after.outcome is Outcome.SOLVED and after.rejected == ()


def test_a_task_that_turns_numbers_into_none_is_named() -> None:
    controller = HybridController(tasks=[LiftTask(target_over=True)])
    command = step(controller, 0, lift=(0.0, 0.1))
    assert command.outcome is Outcome.ANALYTIC_FALLBACK
    assert [said.split(":")[0] for said in command.rejected] == ["task lift"]


def test_a_weight_below_zero_is_named() -> None:
    """The program has no least cost then, which OSQP does not always find out."""
    controller = HybridController(AT_ONCE, tasks=[LiftTask()])
    for tick in range(3):
        command = step(controller, tick, lift=(10.0, -5e3))
        assert command.outcome is Outcome.ANALYTIC_FALLBACK
        assert any(said.startswith("task lift: ") and "-5000" in said for said in command.rejected), command.rejected
    assert step(controller, 3, lift=(10.0, 0.1)).outcome is Outcome.SOLVED


def test_crossed_bounds_are_named() -> None:
    controller = HybridController(AT_ONCE, limits=[ClimbLimit()])
    assert step(controller, 0, climb=(-5.0, 5.0)).rejected == ()
    command = step(controller, 1, climb=(2.0, 0.5))
    assert command.outcome is Outcome.ANALYTIC_FALLBACK
    assert command.rejected == ("limit climb: its lower bound is 1.5 m/s^2 above its upper one",)
    after = step(controller, 2, climb=(-5.0, 5.0))
    assert after.outcome is Outcome.SOLVED and after.rejected == ()


def test_a_bound_without_end_is_named() -> None:
    command = step(HybridController(limits=[ClimbLimit()]), 0, climb=(-5.0, math.inf))
    assert command.outcome is Outcome.ANALYTIC_FALLBACK
    assert command.rejected and command.rejected[0].startswith("input climb: ")


def test_no_fallback_without_a_word(monkeypatch: pytest.MonkeyPatch) -> None:
    """A sound program that no solver solves is said to be just that."""
    controller = HybridController(limits=[ClimbLimit()])
    step(controller, 0, climb=(-5.0, 5.0))
    monkeypatch.setattr(controller.engine, "solve", lambda: None)
    command = step(controller, 1, climb=(-5.0, 5.0))
    assert command.rejected == ("program: no solver found a solution",)


# ---------------------------------------------------------------------------------------- refused when it is built


class CurvedTask(Task):
    """A sound row and one that is not affine in the thrusts."""

    def rows(self, model: Model) -> list[TaskRow]:
        """Two rows in newtons."""
        u = model.thrust
        wishes = {"straight": u[0], "curved": u[0] * u[1]}
        return [
            TaskRow(name=name, unit="N", expression=wish, target=u[0] * 0.0, weight=ca.SX(1.0))
            for name, wish in wishes.items()
        ]


class CurvedLimit(Limit):
    """A row that is not affine in the acceleration."""

    def rows(self, model: Model) -> list[LimitRow]:
        """One soft row."""
        square = model.acceleration[2] ** 2
        return [
            LimitRow(name="bent", unit="m^2/s^4", expression=square, lower=ca.SX(-1), upper=ca.SX(1), slack_weight=1.0)
        ]


class MovingTarget(Task):
    """A target that depends on the thrusts: the row would cost something else than it says."""

    def rows(self, model: Model) -> list[TaskRow]:
        """One row in newtons."""
        u = model.thrust
        return [TaskRow(name="moving", unit="N", expression=u[0], target=u[1], weight=ca.SX(1.0))]


class WideLift(Task):
    """Asks for the parameter "lift" in another size."""

    def rows(self, model: Model) -> list[TaskRow]:
        """One row in newtons."""
        lift = model.signals.input("lift", 3)
        return [TaskRow(name="wide", unit="N", expression=model.thrust[0], target=lift[0], weight=lift[1])]


@pytest.mark.parametrize(
    ("tasks", "limits", "words"),
    [
        ([CurvedTask()], [], "task curved: .*affine"),
        ([], [CurvedLimit()], "limit bent: .*affine"),
        ([MovingTarget()], [], "moving"),
        ([LiftTask(), LiftTask()], [], "task .*'lift'"),
        ([], [ClimbLimit(), ClimbLimit()], "limit .*'climb'"),
        ([LiftTask(), WideLift()], [], "'lift' has 2 entries, not 3"),
    ],
)
def test_rows_that_make_no_program_are_refused_when_it_is_built(
    tasks: list[Task], limits: list[Limit], words: str
) -> None:
    with pytest.raises(ConfigError, match=words):
        HybridController(tasks=tasks, limits=limits)


def test_a_task_and_a_limit_may_share_a_name() -> None:
    problem = HybridController().problem
    assert "yaw" in problem.row_names and "yaw" in {row.name for row in problem.task_rows}


class FreeLimit(Limit):
    """A soft row whose slack costs nothing."""

    def __init__(self, price: float) -> None:
        self.slack_price = price

    def rows(self, model: Model) -> list[LimitRow]:
        """One soft row in newtons."""
        u = model.thrust[0]
        return [
            LimitRow(name="free", unit="N", expression=u, lower=ca.SX(0), upper=ca.SX(9), slack_weight=self.slack_price)
        ]


@pytest.mark.parametrize("price", [0.0, -1.0, math.nan, math.inf])
def test_a_slack_weight_out_of_range_is_refused(price: float) -> None:
    with pytest.raises(ConfigError, match="limit free: slack_weight"):
        HybridController(limits=[FreeLimit(price)])


def test_every_soft_row_has_its_own_slack() -> None:
    controller = HybridController(limits=[ClimbLimit(), FreeLimit(1.0)])
    step(controller, 0, climb=(-5.0, 5.0))
    problem, (_, _, a, _, _) = controller.problem, dense(controller)
    for row, slot in zip(a, problem.row_slack, strict=True):
        expected = np.zeros(len(problem.variable_names) - 6)
        expected[slot - 6 : slot - 5] = -1.0 * (slot >= 0)
        np.testing.assert_array_equal(row[6:], expected)
    assert len(set(problem.row_slack.tolist()) - {-1}) == len(problem.row_names) - 6
