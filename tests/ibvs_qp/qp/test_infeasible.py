"""Hard limits that contradict each other: always named, and only those that are needed, checked by another solver."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from controller_scenes import measured, random_tick
from scipy.optimize import linprog

from ibvs_qp.command import Command, Outcome
from ibvs_qp.config import ControllerConfig, LimitSettings, SolverSettings
from ibvs_qp.controller import HybridController
from ibvs_qp.limits import Limit
from ibvs_qp.measurement import Reference
from ibvs_qp.model.model import Model
from ibvs_qp.model.rows import LimitRow
from ibvs_qp.qp.explain import TickReplay
from ibvs_qp.qp.infeasible import conflicting_rows
from ibvs_qp.qp.problem import ProgramData

HARD = ControllerConfig(limits=LimitSettings(hard_barriers=True))
WORDS = "limits: no solution keeps all of "


def least_violation(data: ProgramData, rows: list[int]) -> float:
    """By how much the worst of these rows is broken at best [row unit], by scipy's interior and simplex codes."""
    matrix, lower, upper = data.rows()[rows, :6], data.lower[rows], data.upper[rows]
    one = np.ones((len(rows), 1))
    found = linprog(
        np.append(np.zeros(6), 1.0),
        A_ub=np.block([[matrix, -one], [-matrix, -one]]),
        b_ub=np.concatenate((upper, -lower)),
        bounds=[(None, None)] * 6 + [(-1e3, None)],
    )
    return float(found.x[-1])


def assert_smallest_conflict(controller: HybridController, names: tuple[str, ...]) -> None:
    """The rows have no common solution, and without any one of them they have."""
    data, rows = controller.engine.data, [controller.problem.row_names.index(name) for name in names]
    assert least_violation(data, rows) > 1e-9
    for spared in rows:
        others = [row for row in rows if row != spared]
        assert not others or least_violation(data, others) <= 1e-9, controller.problem.row_names[spared]


def said(command: Command) -> tuple[str, ...]:
    """The rows that a command names as a conflict."""
    (words,) = [reason for reason in command.rejected if reason.startswith(WORDS)]
    return tuple(words.removeprefix(WORDS).split(", "))


@pytest.mark.slow
@pytest.mark.parametrize("spin", [1.2, 2.0])  # rad/s: about one axis too many, about several
def test_every_conflict_is_named_and_nothing_is_named_that_could_be_spared(spin: float) -> None:
    rng, controller, conflicts, sets = np.random.default_rng(0), HybridController(HARD), 0, set()
    everything = list(range(len(controller.problem.row_names)))
    for tick in range(150):
        controller.reset()
        measurement, reference = random_tick(rng, tick % 3)
        command = controller.step(replace(measurement, angular_velocity=rng.normal(0.0, spin, 3)), reference)
        names = controller.engine.conflict
        assert (command.outcome is Outcome.ANALYTIC_FALLBACK) == bool(names)
        assert bool(names) == (least_violation(controller.engine.data, everything) > 1e-4)
        if names:
            conflicts += 1
            sets.add(names)
            assert said(command) == names
            assert_smallest_conflict(controller, names)
    assert conflicts > 5 and len(sets) > 1


class Acceleration(Limit):
    """Hard bounds on one acceleration."""

    def __init__(self, name: str, axis: int, lower: float, upper: float) -> None:
        self.name, self.axis, self.lower, self.upper = name, axis, lower, upper

    def rows(self, model: Model) -> list[LimitRow]:
        """One hard row."""
        wish = model.acceleration[self.axis]
        return [LimitRow(name=self.name, unit="", expression=wish, lower=ca.SX(self.lower), upper=ca.SX(self.upper))]


def test_two_rows_that_contradict_each_other_are_named_alone() -> None:
    limits = [Acceleration("fall", 2, 1.0, 5.0), Acceleration("spin", 5, -9.0, 9.0), Acceleration("rise", 2, -5.0, 0.5)]
    controller = HybridController(limits=limits)
    command = controller.step(measured(0), Reference())
    assert said(command) == ("fall", "rise")
    assert_smallest_conflict(controller, controller.engine.conflict)


def test_a_row_that_holds_no_thrust_conflicts_with_itself() -> None:
    class Never(Limit):
        def rows(self, model: Model) -> list[LimitRow]:
            none = 0.0 * model.thrust[0]
            return [LimitRow(name="never", unit="", expression=none, lower=ca.SX(1.0), upper=ca.SX(2.0))]

    command = HybridController(limits=[Never()]).step(measured(0), Reference())
    assert said(command) == ("never",)


def test_a_conflict_is_named_however_early_osqp_stops() -> None:
    """A capped iterate holds no certificate: the names do not come from there."""
    short = SolverSettings(max_iterations=1, check_interval=1)
    controller = HybridController(
        replace(HARD, solver=short), limits=[Acceleration("fall", 2, 1, 5), Acceleration("rise", 2, -5, 0)]
    )
    assert said(controller.step(measured(0), Reference())) == ("fall", "rise")


def test_rows_that_a_solution_satisfies_are_no_conflict() -> None:
    for soft in (False, True):
        controller = HybridController(ControllerConfig(limits=LimitSettings(hard_barriers=not soft)))
        assert controller.step(measured(0), Reference()).outcome is Outcome.SOLVED
        assert conflicting_rows(controller.problem, controller.engine.data) == ()
    spinning = HybridController()  # what is soft contradicts nobody
    spinning.step(measured(0, angular_velocity=np.array([3.0, 3.0, 3.0])), Reference())
    assert conflicting_rows(spinning.problem, spinning.engine.data) == ()


def test_a_replay_names_the_conflict_of_a_tick_and_forgets_it() -> None:
    controller = HybridController(HARD)
    controller.step(measured(0), Reference())
    sound = controller.engine.data.point.copy()
    controller.step(measured(1, angular_velocity=np.array([0.0, 3.0, 0.0])), Reference())
    replay = TickReplay(controller.problem)
    assert replay.explain(controller.engine.data.point) is None
    assert replay.conflict == controller.engine.conflict and "tilt_pitch" in replay.conflict
    assert replay.explain(sound) is not None and replay.conflict == ()
