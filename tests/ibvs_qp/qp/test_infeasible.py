"""Hard limits that contradict each other are named, by another solver; how far the price of a limit holds."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from controller_scenes import CEILING, measured, random_tick
from scipy import sparse
from scipy.optimize import linprog
from small_vehicle import SmallVehicle

from ibvs_qp.command import Command, Outcome
from ibvs_qp.config import ControllerConfig, LimitSettings, SolverSettings
from ibvs_qp.controller import HybridController
from ibvs_qp.limits import Limit
from ibvs_qp.measurement import Reference
from ibvs_qp.model.model import Model
from ibvs_qp.model.rows import LimitRow
from ibvs_qp.qp.exact import ExactSolver
from ibvs_qp.qp.explain import BoundRange, TickReplay, bound_ranges
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


VARIABLES, ROWS = 6, 9
#: Beside the end of a range, as a fraction of it: the set of active limits is looked at on both sides.
BESIDE = 1e-3


class Patterns:
    """Sparsity for the solver."""

    def __init__(self, p: np.ndarray, a: np.ndarray) -> None:
        self.p_pattern, self.a_pattern = sparse.csc_matrix(p), sparse.csc_matrix(a)


class Program:
    """A dense program and its exact solution."""

    def __init__(self, hessian: np.ndarray, q: np.ndarray, rows: np.ndarray, bounds: np.ndarray) -> None:
        self.hessian, self.q, self.rows, self.bounds = hessian, q, rows, bounds
        self._solver = ExactSolver(Patterns(np.triu(np.ones_like(hessian)), np.ones_like(rows)))

    def solve(self, row: int = 0, side: int = 0, change: float = 0.0) -> tuple[float, np.ndarray, np.ndarray] | None:
        """Cost, solution and multipliers with one bound moved; None without a solution."""
        lower, upper = self.bounds.copy()
        (lower, upper)[side][row] += change
        p = np.concatenate([self.hessian[: j + 1, j] for j in range(len(self.q))])
        found = self._solver.solve(p, self.q, self.rows.T.ravel(), lower, upper)
        if found is None:
            return None
        x, y = found.x, found.y
        return float(0.5 * x @ self.hessian @ x + self.q @ x), x, y

    def ranges(self) -> tuple[np.ndarray, dict[int, BoundRange]]:
        found = self.solve()
        assert found is not None
        _, x, y = found
        return y, bound_ranges(self.hessian, self.rows, self.bounds[0], self.bounds[1], x, y)


def random_program(seed: int) -> Program:
    """A program whose unlimited solution lies outside of several bounds, with two soft rows."""
    random = np.random.default_rng(seed)
    root = random.normal(size=(VARIABLES, VARIABLES))
    hessian = np.diag(np.concatenate((np.ones(VARIABLES), [30.0, 300.0])))
    hessian[:VARIABLES, :VARIABLES] = root @ root.T + 0.05 * np.eye(VARIABLES)
    rows = np.zeros((ROWS, VARIABLES + 2))
    rows[:, :VARIABLES] = np.vstack((np.eye(VARIABLES), random.normal(size=(ROWS - VARIABLES, VARIABLES))))
    rows[-2, -2] = rows[-1, -1] = -1.0
    bounds = np.vstack((-random.uniform(0.2, 1.0, ROWS), random.uniform(0.2, 1.0, ROWS)))
    return Program(hessian, np.concatenate((random.normal(scale=3.0, size=VARIABLES), [0.0, 0.0])), rows, bounds)


@pytest.mark.parametrize("seed", range(8))
def test_the_same_limits_are_active_up_to_the_end_and_others_beyond(seed: int) -> None:
    program = random_program(seed)
    y, ranges = program.ranges()
    assert set(ranges) == set(np.flatnonzero(y)) and ranges
    for row, found in ranges.items():
        side = int(y[row] > 0.0)
        for end in (found.lower, found.upper):
            if not np.isfinite(end):
                continue
            inside, beyond = (program.solve(row, side, (1.0 + sign * BESIDE) * end) for sign in (-1.0, 1.0))
            assert inside is not None and (np.sign(inside[2]) == np.sign(y)).all()
            assert beyond is None or (np.sign(beyond[2]) != np.sign(y)).any()


@pytest.mark.parametrize("seed", range(8))
def test_the_cost_falls_by_what_is_stated_and_by_less_than_the_price_promises(seed: int) -> None:
    program = random_program(seed)
    y, ranges = program.ranges()
    at_first = program.solve()
    assert at_first is not None
    for row, found in ranges.items():
        side = int(y[row] > 0.0)
        change = found.upper if side else found.lower
        moved = program.solve(row, side, change)
        assert moved is not None
        assert found.fall == pytest.approx(at_first[0] - moved[0], rel=1e-6, abs=1e-9)
        assert 0.5 * abs(y[row] * change) <= found.fall * (1.0 + 1e-9) < abs(y[row] * change) * (1.0 + 1e-9)
        released = (1.0 + BESIDE) * change
        beyond = program.solve(row, side, released)
        assert beyond is not None and (beyond[2][found.end] == 0.0) == (y[found.end] != 0.0)


def test_rows_that_depend_on_each_other_have_no_range() -> None:
    one = np.ones(2)
    assert bound_ranges(np.eye(2), np.ones((2, 2)), -one, one, 0.5 * one, 2.0 * one) == {}


def test_a_weak_rotor_of_a_tick_is_released_where_the_explanation_says() -> None:
    """The bound of the recorded tick is moved in the program; the explanation is that of `ibvs-qp explain`."""
    controller, limit = HybridController(), np.full(6, CEILING)
    limit[3] = 9.0  # below hover: this rotor is missed
    vehicle = SmallVehicle(controller.config)
    for _ in range(20):
        command = controller.step(vehicle.measure(thrust_max=limit), Reference(standoff=0.1))
        vehicle.fly(command.thrusts)
    data, exact = controller.engine.data, controller.engine.exact
    found = TickReplay(controller.problem).explain(data.point)
    assert found is not None
    place = [each.name for each in found.active_limits].index(controller.problem.row_names[3])
    price, span = found.active_limits[place].price, found.limit_ranges[place]
    costs = []
    for change in (0.0, span.change_high, 1.01 * span.change_high):
        moved = data.upper.copy()
        moved[3] += change
        solution = exact.solve(data.p, data.q, data.a, data.lower, moved)
        assert solution is not None
        costs.append(0.5 * solution[0] @ data.hessian() @ solution[0] + data.q @ solution[0])
    assert span.until == "released" or span.until.startswith(tuple(controller.problem.row_names))
    assert span.cost_fall == pytest.approx(costs[0] - costs[1], rel=1e-4)
    assert span.cost_fall < 0.75 * price * span.change_high, "the price alone promises too much"
    if span.until == "released":
        assert solution[1][3] == 0.0 and costs[1] == pytest.approx(costs[2], abs=1e-9)
