"""Assembly of tasks and limits to one program of fixed sparsity, condensed to thrusts and slacks, and its values."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from operator import gt, lt
from typing import TYPE_CHECKING

import casadi as ca
import numpy as np

from ibvs_qp.config.errors import ConfigError
from ibvs_qp.limits.limit import WIDE, Limit
from ibvs_qp.model.inputs import setting_values
from ibvs_qp.model.model import Model
from ibvs_qp.model.rows import LimitRow, TaskRow
from ibvs_qp.qp.solver import DenseProgram
from ibvs_qp.symbolic.function import ArrayFunction, StepFunction
from ibvs_qp.symbolic.logic import clamp
from ibvs_qp.symbolic.signals import stack
from ibvs_qp.tasks.task import Task

if TYPE_CHECKING:
    from scipy import sparse  # loaded with the first program

#: More rotors than this have directions without a wrench.
REDUNDANT_ABOVE = 6
#: Excess over a limit that is no noise, over `limits.thrust_noise_n` [-]: far beyond its reach a push that is clipped
#: tilts the vehicle.
NO_NOISE = 5.0


class AffineRows:
    r"""Rows :math:`r = J_a \dot\nu + J_u u + c` with the acceleration :math:`\dot\nu = G u + a_0` eliminated.

    Products go through the six accelerations, not through every row's thrusts: a third of the arithmetic.
    """

    def __init__(self, model: Model, rows: ca.SX) -> None:
        u, acceleration = model.thrust, model.acceleration
        self._model = model
        self._by_acceleration, self._by_thrust = ca.jacobian(rows, acceleration), ca.jacobian(rows, u)
        at_rest = ca.substitute(rows, ca.veccat(u, acceleration), ca.DM.zeros(model.rotors + 6))
        self.constant = at_rest + self._by_acceleration @ model.free_acceleration

    @property
    def per_thrust(self) -> ca.SX:
        """J = J_a G + J_u, (rows, n)."""
        return self._by_acceleration @ self._model.acceleration_per_thrust + self._by_thrust

    def at(self, thrusts: ca.SX) -> ca.SX:
        """Values of the rows, (rows,)."""
        return self.per_thrust @ thrusts + self.constant

    def least_squares(self, weights: ca.SX, targets: ca.SX) -> tuple[ca.SX, ca.SX]:
        """Hessian J' W J, (n, n), and gradient J' W (c - targets), (n,)."""
        per_acceleration = self._model.acceleration_per_thrust
        ja, ju = self._by_acceleration, self._by_thrust
        weighted_a, weighted_u = ja.T @ ca.diag(weights), ju.T @ ca.diag(weights)
        cross = per_acceleration.T @ (weighted_a @ ju)
        by_acceleration = _symmetric_product(weighted_a, ja) @ per_acceleration
        hessian = _symmetric_product(per_acceleration.T, by_acceleration) + cross + cross.T + weighted_u @ ju
        offset = self.constant - targets
        return ca.densify(hessian), per_acceleration.T @ (weighted_a @ offset) + weighted_u @ offset


def _symmetric_product(left: ca.SX | ca.DM, right: ca.SX) -> ca.SX:
    """Product known to be symmetric: only its upper triangle is computed, so that both halves are bit-identical."""
    size = left.shape[0]
    upper = ca.SX(size, size)
    for i in range(size):
        for j in range(i, size):
            upper[i, j] = left[i, :] @ right[:, j]
    return ca.triu2symm(upper)


class QpProblem:
    r"""The program :math:`\min \tfrac12 x^T P x + q^T x,\; l \le A x \le u` with x = (thrusts, slacks).

    Accelerations are eliminated, soft equalities live in P: small, dense, well scaled (the form that keeps the
    tail of ADMM iterations short). P and A keep one sparsity for every phase, line count and fault.

    A push near its reach runs rotors at their limits, and the noise of all rows, 0.25 N of thrust, passes these limits.
    By the weights the push, the lightest row, would pay for all of it. So in contact the least squares go about thrusts
    :math:`\bar u` that are clipped within delta, `limits.thrust_noise_n`,

    .. math::
        \bar u = u_0 + \lambda\, \psi \big( \operatorname{clip}_{[l, u]}(u_0) - u_0 \big), \quad q = -P \bar u,

    with the thrusts u_0 without limits and the vehicle's own limits l and u. psi(e) is e up to delta and falls to zero
    at five times delta, which is no noise: a small excess costs every row its share, as in a clipped law, and the
    weights decide about a large one. `_noise_beyond_limits` has the exceptions.

    Attributes:
        variable_names: Names of the entries of x.
        task_names: Name and unit of every task row.
        row_names: Names of the rows of A.
        values: Expressions of the non-zeros of P (upper triangle), q, A, l, u, of the program's solution without A, and
            of the thrusts without limits; extra results of the step function.
        report: Function of point (inputs and states) and thrusts: achieved and target values of every task row, and
            weights, (rows,) each.
        switches: Names of the settings that switch its limits.
        row_slack: Column of every row's slack in x, -1 where the row is hard, (rows,).

    Raises:
        ConfigError: When two rows share a name, or a row is not affine in the thrusts.
    """

    def __init__(self, model: Model, tasks: Sequence[Task], limits: Sequence[Limit]) -> None:
        self.model = model
        self.task_rows: list[TaskRow] = [row for task in tasks for row in _checked_tasks(model, task)]
        self.limit_rows: list[LimitRow] = [row for limit in limits for row in _checked_limits(model, limit)]
        _refuse_duplicates("task", [row.name for row in self.task_rows])
        _refuse_duplicates("limit", [row.name for row in self.limit_rows])
        self.switches = frozenset(limit.switch_setting for limit in limits)
        soft = [place for place, row in enumerate(self.limit_rows) if row.slack_weight is not None]
        n, m, rows = model.rotors, len(soft), len(self.limit_rows)

        weights = ca.vertcat(*(row.weight for row in self.task_rows))
        targets = ca.vertcat(*(row.target for row in self.task_rows))
        achieved = AffineRows(model, ca.vertcat(*(row.expression for row in self.task_rows)))
        convex = ca.vertcat(*(_convex(row.weight) for row in self.task_rows))
        hessian, gradient = achieved.least_squares(convex, targets)
        free = _unlimited_thrusts(hessian, gradient)
        noise = _noise_beyond_limits(model, free)
        gradient -= hessian @ noise
        slack_weights = [ca.SX(row.slack_weight) for row in self.limit_rows if row.slack_weight is not None]
        p = ca.triu(ca.diagcat(hessian, *slack_weights))
        q = ca.vertcat(gradient, ca.DM.zeros(m))

        bounds = AffineRows(model, ca.vertcat(*(row.expression for row in self.limit_rows)))
        slack = ca.DM.zeros(rows, m)
        for column, place in enumerate(soft):
            slack[place, column] = -1.0
        a = ca.horzcat(bounds.per_thrust, ca.sparsify(slack))
        lower = ca.vertcat(*(row.lower for row in self.limit_rows)) - bounds.constant
        upper = ca.vertcat(*(row.upper for row in self.limit_rows)) - bounds.constant

        self.values = [p.nz[:], ca.densify(q), a.nz[:], ca.densify(lower), ca.densify(upper)]
        self.values += [ca.vertcat(free + noise, ca.DM.zeros(m)), free]
        point = ca.vertcat(stack(model.signals.inputs), stack(model.signals.states))
        self._at = [point, model.thrust]
        self.report = ArrayFunction("task_report", self._at, [achieved.at(model.thrust), targets, weights])
        self.p_pattern, self.a_pattern = _pattern(p.sparsity()), _pattern(a.sparsity())
        names = model.config.vehicle.geometry.names
        slacks = (f"slack_{self.limit_rows[place].name}" for place in soft)
        self.variable_names = (*(f"thrust_{name}" for name in names), *slacks)
        self.task_names = tuple((row.name, row.unit) for row in self.task_rows)
        self.row_names = tuple(row.name for row in self.limit_rows)
        self.row_units = tuple(row.unit for row in self.limit_rows)
        self.row_slack = np.full(rows, -1)
        self.row_slack[soft] = np.arange(n, n + m)

    @functools.cached_property
    def limit_values(self) -> ArrayFunction:
        """(point, thrusts) to value, lower and upper bound of every limit row in the row's own unit, (rows,) each."""
        values = AffineRows(self.model, ca.vertcat(*(row.expression for row in self.limit_rows))).at(self.model.thrust)
        lower = ca.vertcat(*(row.lower for row in self.limit_rows))
        upper = ca.vertcat(*(row.upper for row in self.limit_rows))
        return ArrayFunction("limit_values", self._at, [values, lower, upper])


def _unlimited_thrusts(hessian: ca.SX, gradient: ca.SX) -> ca.SX:
    """Thrusts without any limit, by Cholesky factors [N], (n,)."""
    root = ca.chol(hessian)
    return ca.solve(root, ca.solve(root.T, -gradient))


def _noise_beyond_limits(model: Model, thrusts: ca.SX) -> ca.SX:
    """Part of the way from thrusts to the vehicle's own limits that is clipped [N], (n,).

    Zero for a rotor with a reported limit, such as a weak one, where an error would last, and for redundant rotors,
    whose noise costs no wrench.
    """
    most = model.limits.thrust_noise_n
    if not model.config.thrust_rows or model.rotors > REDUNDANT_ABOVE:
        return ca.SX(model.rotors, 1)
    (low, high), (floor, ceiling) = model.thrust_limits, model.thrust_box
    own = ca.logic_and(low <= floor, high >= ceiling)
    way = clamp(thrusts, floor, ceiling) - thrusts
    noise = ca.fmax((NO_NOISE * most - ca.fabs(way)) / (NO_NOISE - 1.0), 0.0)
    return model.contact_weight * own * clamp(way, -noise, noise)


def _pattern(sparsity: ca.Sparsity) -> sparse.csc_matrix:
    from scipy import sparse

    column, row = sparsity.get_ccs()
    data = np.ones(sparsity.nnz())
    return sparse.csc_matrix((data, row, column), shape=sparsity.shape)


def _checked_tasks(model: Model, task: Task) -> list[TaskRow]:
    """Rows of a task; of a user's own task, refused where the program cannot contain them."""
    rows = task.rows(model)
    for row in rows if _is_own(task) else ():
        _refuse_curved(model, f"task {row.name}", row.expression, target=row.target, weight=row.weight)
    return rows


def _checked_limits(model: Model, limit: Limit) -> list[LimitRow]:
    """Rows of a limit, far away while its switch is off; of a user's own limit, refused likewise."""
    rows = limit.rows(model)
    for row in rows if _is_own(limit) else ():
        _refuse_curved(model, f"limit {row.name}", row.expression, lower=row.lower, upper=row.upper)
        weight = row.slack_weight
        if weight is not None and not 0.0 < weight < math.inf:
            allowed = "greater than 0 and finite, None if it is hard"
            raise ConfigError(f"limit {row.name}: slack_weight = {weight!r} is refused: {allowed}")
    section, _, switch = (limit.switch_setting or "").partition(".")
    if section != "limits":
        return rows
    on = getattr(model.limits, switch)
    return [
        dataclasses.replace(row, lower=ca.if_else(on, row.lower, -WIDE), upper=ca.if_else(on, row.upper, WIDE))
        for row in rows
    ]


def _convex(weight: ca.SX) -> ca.SX:
    """The weight, NaN if it is negative: no solver accepts that, and `program_faults` names the row.

    OSQP may take a program that is not convex for solved. A setting alone is never negative.
    """
    weight = ca.SX(weight)
    symbols = ca.symvar(weight)
    if symbols and all(symbol.name().startswith("weights.") for symbol in symbols):
        return weight
    return ca.if_else(weight >= 0.0, weight, ca.sqrt(weight))


def _is_own(rows: Task | Limit) -> bool:
    """Whether a task or limit is not one of the package, whose rows the tests check."""
    return not type(rows).__module__.startswith("ibvs_qp.")


def _refuse_duplicates(kind: str, names: list[str]) -> None:
    for name in names:
        if names.count(name) > 1:
            raise ConfigError(f"{kind} rows need unique names: {name!r} appears {names.count(name)} times")


def _refuse_curved(model: Model, row: str, expression: ca.SX, **others: ca.SX) -> None:
    unknown = ca.veccat(model.thrust, model.acceleration)
    if ca.depends_on(ca.jacobian(expression, unknown), unknown):
        raise ConfigError(f"{row}: its expression must be affine in the thrusts")
    for part, symbol in others.items():
        if ca.depends_on(ca.SX(symbol), unknown):
            raise ConfigError(f"{row}: its {part} must not depend on the thrusts")


@dataclass(frozen=True, kw_only=True)
class Program:
    r"""The program of one tick, :math:`\min \tfrac12 x^T P x + q^T x,\; l \le A x \le u` with x = (thrusts, slacks).

    Attributes:
        P, q, A, lower, upper: Its matrices in full.
        variables: Names of the entries of x: thrusts, then slacks of the soft limits.
        limits: Names of the rows of A.
        tasks: Names of the least-squares rows that add up to P and q.
        weights: Weights of the task rows at this tick, (tasks,).
    """

    P: np.ndarray
    q: np.ndarray
    A: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    variables: tuple[str, ...]
    limits: tuple[str, ...]
    tasks: tuple[str, ...]
    weights: np.ndarray


class ProgramData:
    """Values of one step's program, where the step function writes them.

    Attributes:
        p: Non-zeros of the upper triangle of P. Likewise q, a, lower, upper.
        unlimited: Solution of the same program without any row of A, (variables,).
        free: Thrusts without limits [N], (n,): `unlimited` before noise at the limits is clipped.
        further: Further values of the problem, in their order.
        point: Inputs and states of the step; `inputs` are views of it by name.
    """

    def __init__(self, problem: QpProblem, step: StepFunction) -> None:
        self.p, self.q, self.a, self.lower, self.upper, self.unlimited, self.free, *self.further = step.extra
        self._step = step  # owns the memory that the compiled function writes
        self.point, self.inputs = step.point, step.inputs
        self._problem, self._dense = problem, DenseProgram(problem)

    @property
    def beyond_limits(self) -> bool:
        """Whether the thrusts without limits pass a thrust limit, by noise or by more."""
        free = self.free.tolist()
        return any(map(lt, free, self.lower.tolist())) or any(map(gt, free, self.upper.tolist()))

    def hessian(self) -> np.ndarray:
        """P in full, (variables, variables)."""
        return self._dense.hessian(self.p)

    def rows(self) -> np.ndarray:
        """A in full, (rows, variables)."""
        return self._dense.rows(self.a)

    def program(self) -> Program:
        """A copy of the program with its names."""
        problem = self._problem
        return Program(
            P=self.hessian(),
            q=self.q.copy(),
            A=self.rows(),
            lower=self.lower.copy(),
            upper=self.upper.copy(),
            variables=problem.variable_names,
            limits=problem.row_names,
            tasks=tuple(name for name, _ in problem.task_names),
            weights=problem.report(self.point, self.free)[2],
        )

    def limit_values(self, thrusts: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Value, lower and upper bound of every limit row at given thrusts, in the row's own unit."""
        value, lower, upper = self._problem.limit_values(self.point, thrusts)
        return value, lower, upper


class RecordedProgram(ProgramData):
    """The program of recorded steps: set `point`, evaluate, read the values."""

    def __init__(self, problem: QpProblem) -> None:
        step = StepFunction(problem.model.signals, problem.values)
        super().__init__(problem, step)
        self.evaluate = step.evaluate
        for name, value in setting_values(problem.model.config).items():
            step.inputs[name][:] = value
