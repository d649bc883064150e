"""Explanation of a tick: reports of tasks and limits, exact solution of a recorded program, ranges of bounds."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ibvs_qp.command import ActiveLimit, Outcome, TaskReport, TaskReports
from ibvs_qp.config import SolverSettings
from ibvs_qp.config.errors import ConfigError
from ibvs_qp.qp.exact import ExactSolver
from ibvs_qp.qp.infeasible import conflicting_rows
from ibvs_qp.qp.problem import ProgramData, QpProblem, RecordedProgram
from ibvs_qp.qp.solver import ACTIVE_MULTIPLIER, Solver, make_solver

#: Iterations of a solver without a deadline.
LONG = 100_000


@dataclass(frozen=True, kw_only=True)
class LimitValue:
    """Bounds and value of one limit row at a tick, in the row's unit."""

    name: str
    unit: str
    lower: float
    upper: float
    value: float


@dataclass(frozen=True, kw_only=True)
class LimitRange:
    """How far the price of an active limit holds: the changes of its bound over which the same limits are active.

    Attributes:
        change_low: Most negative change of the bound, in the row's unit; -inf where nothing ends it.
        change_high: Most positive change.
        cost_fall: By how much the cost falls as the bound yields to that end; less than the price times the change.
        until: Event at that end: "released", or the name of another limit with "active" or "released".
    """

    change_low: float
    change_high: float
    cost_fall: float
    until: str


@dataclass(frozen=True, kw_only=True)
class Explanation:
    """Targets, results and costs of a tick.

    Attributes:
        thrusts: Of the exact solution [N], (n,).
        tasks: Every task row with a weight; `cost` are their fractions of the cost, in the same order.
        total_cost: Cost of the tick, without unit: weights are per squared unit of their rows.
        slack_cost: Fraction of the cost for slack; with those of the tasks it sums to one.
        active_limits: Active limits by falling multiplier; `limit_cost` are the fractions of the cost for their slack,
            zero for a hard one, `limit_rows` their bounds and values, and `limit_ranges` how far their prices hold, in
            the same order.
        unallocated_wrench: Wrench of the same tick without limits minus the wrench [N, N m], (6,).
        clipped: Part of the thrusts without limits that is clipped as noise (`limits.thrust_noise_n`) [N], (n,). Prices
            and ranges are of the program after that: its cost is about the clipped thrusts.
    """

    thrusts: np.ndarray
    tasks: Sequence[TaskReport]
    cost: tuple[float, ...]
    total_cost: float
    slack_cost: float
    active_limits: tuple[ActiveLimit, ...]
    limit_cost: tuple[float, ...]
    limit_rows: tuple[LimitValue, ...]
    limit_ranges: tuple[LimitRange, ...]
    unallocated_wrench: np.ndarray
    clipped: np.ndarray


def task_reports(problem: QpProblem, data: ProgramData, thrusts: np.ndarray) -> TaskReports:
    """Target, achieved value and residual of every task row with a weight."""
    return TaskReports(problem.task_names, problem.report, data.point.copy(), thrusts)


def active_limits(problem: QpProblem, x: np.ndarray, y: np.ndarray) -> tuple[ActiveLimit, ...]:
    """Limits with a multiplier: name, side, |dJ*/d bound| and slack."""
    active = []
    for i in np.flatnonzero(np.abs(y) > ACTIVE_MULTIPLIER):
        column = problem.row_slack[i]
        active.append(
            ActiveLimit(
                name=problem.row_names[i],
                side="upper" if y[i] > 0 else "lower",
                price=abs(float(y[i])),
                slack=abs(float(x[column])) if column >= 0 else 0.0,
                unit=problem.row_units[i],
            )
        )
    return tuple(active)


class TickReplay:
    """Explains recorded ticks of one program.

    Args:
        problem: The program.
        solver: Name of the solver (`solver.name`); None for the exact one.

    Attributes:
        conflict: Names of the rows that contradict each other, where the last tick explained has no solution.
    """

    def __init__(self, problem: QpProblem, solver: str | None = None) -> None:
        self._problem, self._data = problem, RecordedProgram(problem)
        self._exact = ExactSolver(problem)
        self._solver: Solver = self._exact
        if solver is not None:
            self._solver = make_solver(problem, SolverSettings(name=solver, max_iterations=LONG))
        self.conflict: tuple[str, ...] = ()

    def explain(self, point: np.ndarray) -> Explanation | None:
        """Solve and explain the program of a recorded step; None if it has no solution, see `conflict`.

        Args:
            point: Inputs and states of the step as in `ProgramData.point`.

        Raises:
            ConfigError: When it is of another program, or not finite.
        """
        data, problem = self._data, self._problem
        if point.shape != data.point.shape or not np.isfinite(point).all():
            expected = f"the program has {len(data.point)} finite inputs and states"
            raise ConfigError(f"a recorded tick of {len(point)} numbers is refused: {expected}")
        data.point[:] = point
        data.evaluate()
        self._solver.reset()
        solution, self.conflict = self._solver.solve(data.p, data.q, data.a, data.lower, data.upper), ()
        if solution is None or solution.status is not Outcome.SOLVED:
            self.conflict = conflicting_rows(problem, data)
            return None
        x, y = solution.x, solution.y
        thrusts = x[: problem.model.rotors]
        tasks = tuple(task_reports(problem, data, thrusts))
        cost = np.array([0.5 * task.weight * task.residual**2 for task in tasks])
        slack, slack_weights = x[len(thrusts) :], data.hessian().diagonal()[len(thrusts) :]
        slack_cost = 0.5 * float(slack @ (slack_weights * slack))
        total = float(cost.sum()) + slack_cost or 1.0
        limits = sorted(active_limits(problem, x, y), key=lambda limit: -limit.price)
        weights = dict(zip(problem.variable_names[len(thrusts) :], slack_weights, strict=True))
        paid = (0.5 * weights.get(f"slack_{limit.name}", 0.0) * limit.slack**2 / total for limit in limits)
        effectiveness = problem.model.effectiveness
        return Explanation(
            thrusts=thrusts,
            tasks=tasks,
            cost=tuple((cost / total).tolist()),
            total_cost=total,
            slack_cost=slack_cost / total,
            active_limits=tuple(limits),
            limit_cost=tuple(paid),
            limit_rows=self.limit_values([limit.name for limit in limits], thrusts),
            limit_ranges=self._limit_ranges([limit.name for limit in limits]),
            unallocated_wrench=effectiveness @ (data.free - thrusts) * (bool(limits) or data.beyond_limits),
            clipped=data.unlimited[: len(thrusts)] - data.free,
        )

    def limit_values(self, names: Sequence[str], thrusts: np.ndarray) -> tuple[LimitValue, ...]:
        """Bounds and values of limit rows by name at the tick explained last, for given thrusts [N], (n,)."""
        problem, data = self._problem, self._data
        rows = [problem.row_names.index(name) for name in names]
        values, lower, upper = data.limit_values(thrusts)
        return tuple(
            LimitValue(
                name=problem.row_names[row],
                unit=problem.row_units[row],
                lower=float(lower[row]),
                upper=float(upper[row]),
                value=float(values[row]),
            )
            for row in rows
        )

    def _limit_ranges(self, names: Sequence[str]) -> tuple[LimitRange, ...]:
        """Ranges by name, at the exact solution: its multipliers of inactive rows are zero."""
        data, every = self._data, self._problem.row_names
        exact = self._exact.solve(data.p, data.q, data.a, data.lower, data.upper)
        assert exact is not None
        found = bound_ranges(data.hessian(), data.rows(), data.lower, data.upper, exact.x, exact.y)
        ranges = []
        for row in map(every.index, names):
            if (at := found.get(row)) is None:
                ranges.append(LimitRange(change_low=0.0, change_high=0.0, cost_fall=0.0, until="unknown"))
                continue
            event = "active" if exact.y[at.end] == 0.0 else "released"
            until = event if at.end == row else f"{every[at.end]} {event}"
            ranges.append(LimitRange(change_low=at.lower, change_high=at.upper, cost_fall=at.fall, until=until))
        return tuple(ranges)


class BoundRange(NamedTuple):
    """Changes of one bound over which the set of active limits stays the same; there the cost is a parabola of it."""

    lower: float  # most negative, in the row's unit; -inf where nothing ends it
    upper: float
    end: int  # row that is released, or becomes active, at the end on the side to which the bound yields
    fall: float  # of the cost to that end


def bound_ranges(
    hessian: np.ndarray, rows: np.ndarray, lower: np.ndarray, upper: np.ndarray, x: np.ndarray, y: np.ndarray
) -> dict[int, BoundRange]:
    r"""Ranges of the bounds of all active rows, by row.

    With the active rows :math:`A_W x = b_W`, solution and multipliers are linear in the bounds,

    .. math:: \begin{pmatrix} P & A_W^T \\ A_W & 0 \end{pmatrix} \begin{pmatrix} dx \\ dy_W \end{pmatrix} =
        \begin{pmatrix} 0 \\ db_W \end{pmatrix},

    until a multiplier is zero or another row meets its bound. The derivative of the cost by a bound is :math:`-y`.

    Args:
        hessian: P, positive definite, (variables, variables).
        rows: A, (rows, variables).
        lower: Bounds of A x, (rows,).
        upper: The same.
        x: Solution, (variables,).
        y: Its multipliers, > 0 at an upper bound, exactly 0 of an inactive row, (rows,).

    Returns:
        One range per active row; an empty result if the active rows depend on each other.

    Source: Best, An algorithm for the solution of the parametric quadratic programming problem, 1996.
    """
    active, size = np.flatnonzero(y), len(x)
    matrix = np.zeros((size + len(active), size + len(active)))
    matrix[:size, :size], matrix[:size, size:], matrix[size:, :size] = hessian, rows[active].T, rows[active]
    try:
        moves = np.linalg.solve(matrix, np.eye(len(matrix))[:, size:])
    except np.linalg.LinAlgError:
        return {}
    value, free, found = rows @ x, np.flatnonzero(y == 0.0), {}
    for place, row in enumerate(active):
        slopes = rows @ moves[:size, place]  # of all values per unit of this bound
        changes = np.zeros(len(y))
        changes[active] = moves[size:, place]  # of all multipliers
        ends = {}
        for way in (-1.0, 1.0):
            room = np.full(len(y), math.inf)
            falling = np.flatnonzero(way * changes * y < 0.0)
            room[falling] = -y[falling] / (way * changes[falling])
            rising, sinking = free[way * slopes[free] > 0.0], free[way * slopes[free] < 0.0]
            room[rising] = (upper - value)[rising] / (way * slopes[rising])
            room[sinking] = (lower - value)[sinking] / (way * slopes[sinking])
            if way * y[row] < 0.0:  # it meets the row's other bound
                room[row] = upper[row] - lower[row]
            end = int(np.argmin(room))
            ends[way] = max(float(room[end]), 0.0), end
        length, end = ends[math.copysign(1.0, y[row])]
        fall = (abs(y[row]) + 0.5 * changes[row] * length) * length  # the multiplier falls by `changes` on the way
        found[int(row)] = BoundRange(lower=-ends[-1.0][0], upper=ends[1.0][0], end=end, fall=float(fall))
    return found
