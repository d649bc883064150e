"""Whatever keeps the program from being solved is named: numbers that are none, crossed bounds, rows of one name."""

from __future__ import annotations

import math

import numpy as np
import pytest
from controller_scenes import line_references, measured

from ibvs_qp.command import Command, Outcome
from ibvs_qp.controller import HybridController
from ibvs_qp.limits import Limit
from ibvs_qp.measurement import Reference
from ibvs_qp.qp.model import LimitRow, SymbolicModel, TaskRow
from ibvs_qp.tasks import Task


class LiftTask(Task):
    """One row on the first rotor; the parameter "lift" holds target and weight."""

    def __init__(self, target_over: bool = False) -> None:
        self.target_over = target_over

    def rows(self, model: SymbolicModel) -> list[TaskRow]:
        """One row in newtons; on demand its target is divided by the parameter."""
        lift = model.parameter("lift", 2)
        target = 1.0 / lift[0] if self.target_over else lift[0]
        return [TaskRow(name="lift", unit="N", expression=model.thrust[0], target=target, weight=lift[1])]


class ClimbLimit(Limit):
    """Vertical acceleration between the two entries of the parameter "climb"."""

    def rows(self, model: SymbolicModel) -> list[LimitRow]:
        """One soft row in m/s^2."""
        climb = model.parameter("climb", 2)
        up = -model.acceleration[2]
        return [LimitRow(name="climb", unit="m/s^2", expression=up, lower=climb[0], upper=climb[1], price=10.0)]


def step(controller: HybridController, tick: int, **inputs: tuple[float, ...]) -> Command:
    """One tick with the parameters of tasks and limits of one's own."""
    for name, values in inputs.items():
        controller.setpoints.tick.inputs[name][:] = values
    command = controller.step(measured(tick), Reference(lines=line_references(2)))
    assert np.isfinite(command.thrusts).all()
    return command


# ------------------------------------------------------------------------------------------------- no silent fallback


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("place", [0, 1])
def test_a_parameter_that_is_no_number_is_named(value: float, place: int) -> None:
    controller = HybridController(tasks=[LiftTask()])
    assert step(controller, 0, lift=(10.0, 0.1)).rejected == ()
    broken = [10.0, 0.1]
    broken[place] = value
    command = step(controller, 1, lift=tuple(broken))
    assert command.outcome is Outcome.ANALYTIC_FALLBACK
    (said,) = command.rejected
    assert said.startswith("parameter lift: ") and "not finite" in said
    after = step(controller, 2, lift=(10.0, 0.1))
    assert after.outcome is Outcome.SOLVED and after.rejected == ()


def test_a_task_that_turns_numbers_into_none_is_named() -> None:
    controller = HybridController(tasks=[LiftTask(target_over=True)])
    command = step(controller, 0, lift=(0.0, 0.1))
    assert command.outcome is Outcome.ANALYTIC_FALLBACK
    assert [said.split(":")[0] for said in command.rejected] == ["task lift"]


def test_a_weight_below_zero_is_named() -> None:
    """The program has no least cost then; a solver is not even asked."""
    controller = HybridController(tasks=[LiftTask()])
    for tick in range(3):
        command = step(controller, tick, lift=(10.0, -5e3))
        assert command.outcome is Outcome.ANALYTIC_FALLBACK
        assert any(said.startswith("task lift: ") and "-5000" in said for said in command.rejected), command.rejected
    assert step(controller, 3, lift=(10.0, 0.1)).outcome is Outcome.SOLVED


def test_crossed_bounds_are_named() -> None:
    controller = HybridController(limits=[ClimbLimit()])
    assert step(controller, 0, climb=(-5.0, 5.0)).rejected == ()
    command = step(controller, 1, climb=(2.0, 0.5))
    assert command.outcome is Outcome.ANALYTIC_FALLBACK
    assert command.rejected == ("limit climb: its lower bound is 1.5 m/s^2 above its upper one",)
    after = step(controller, 2, climb=(-5.0, 5.0))
    assert after.outcome is Outcome.SOLVED and after.rejected == ()


def test_a_bound_without_end_is_named() -> None:
    command = step(HybridController(limits=[ClimbLimit()]), 0, climb=(-5.0, math.inf))
    assert command.outcome is Outcome.ANALYTIC_FALLBACK
    assert command.rejected and command.rejected[0].startswith("parameter climb: ")


def test_no_fallback_without_a_word(monkeypatch: pytest.MonkeyPatch) -> None:
    """A sound program that no solver solves is said to be just that."""
    controller = HybridController(limits=[ClimbLimit()])
    step(controller, 0, climb=(-5.0, 5.0))
    monkeypatch.setattr(controller.engine, "solve", lambda: None)
    command = step(controller, 1, climb=(-5.0, 5.0))
    assert command.rejected == ("program: no solver found a solution",)
