"""Assembly of tasks and limits to one program of fixed sparsity, condensed to thrusts and slacks."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import Protocol

import casadi as ca
import numpy as np
from scipy import sparse

from ibvs_qp.limits.limit import Limit
from ibvs_qp.model.model import Model
from ibvs_qp.model.rows import LimitRow, TaskRow
from ibvs_qp.qp.row_check import check_rows
from ibvs_qp.symbolic.bound_function import ArrayFunction
from ibvs_qp.symbolic.logic import clamp
from ibvs_qp.symbolic.signals import stack
from ibvs_qp.tasks.task import Task

#: More rotors than this have directions without a wrench.
REDUNDANT_ABOVE = 6
#: Excess over a limit that is no noise, over `limits.thrust_noise_n` [-]: far beyond its reach a push that is clipped
#: tilts the vehicle.
NO_NOISE = 5.0


class ProgramPatterns(Protocol):
    """Sparsity of a program: upper triangle of P, and A; enough for a solver."""

    p_pattern: sparse.csc_matrix
    a_pattern: sparse.csc_matrix


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
    """Product known to be symmetric: only its upper triangle is computed, so that both are equal to the bit."""
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
        row_slack: Column of every row's slack in x, -1 where the row is hard, (rows,).

    Raises:
        ConfigError: When two rows share a name, or a row is not affine in the thrusts.
    """

    def __init__(self, model: Model, tasks: Sequence[Task], limits: Sequence[Limit]) -> None:
        self.model = model
        self.task_rows: list[TaskRow] = [row for task in tasks for row in task.rows(model)]
        self.limit_rows: list[LimitRow] = [row for limit in limits for row in limit.rows(model)]
        check_rows(model, self.task_rows, self.limit_rows)
        soft = [place for place, row in enumerate(self.limit_rows) if row.slack_weight is not None]
        n, m, rows = model.rotors, len(soft), len(self.limit_rows)

        weights = ca.vertcat(*(row.weight for row in self.task_rows))
        targets = ca.vertcat(*(row.target for row in self.task_rows))
        achieved = AffineRows(model, ca.vertcat(*(row.expression for row in self.task_rows)))
        # OSQP may take a program that is not convex for solved: the root of a negative weight is NaN, which no solver
        # accepts, and `program_faults` names the row.
        hessian, gradient = achieved.least_squares(ca.if_else(weights >= 0.0, weights, ca.sqrt(weights)), targets)
        free = _unlimited_thrusts(hessian, gradient)
        noise = _noise_beyond_limits(model, free)
        gradient -= hessian @ noise
        slack_weights = [float(self.limit_rows[place].slack_weight or 0.0) for place in soft]
        p = ca.triu(ca.diagcat(hessian, ca.SX(ca.diag(ca.DM(slack_weights)))) if m else hessian)
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

    None for a rotor whose limit is reported (a weak one, say), where an error would last, and none with redundant
    rotors, which give noise up at no cost of the wrench.
    """
    most = model.config.limits.thrust_noise_n
    if not model.config.thrust_rows or most == 0.0 or model.rotors > REDUNDANT_ABOVE:
        return ca.SX(model.rotors, 1)
    (low, high), (floor, ceiling) = model.thrust_limits, model.thrust_box
    own = ca.logic_and(low <= floor, high >= ceiling)
    way = clamp(thrusts, floor, ceiling) - thrusts
    noise = ca.fmax((NO_NOISE * most - ca.fabs(way)) / (NO_NOISE - 1.0), 0.0)
    return model.contact_weight * own * clamp(way, -noise, noise)


def _pattern(sparsity: ca.Sparsity) -> sparse.csc_matrix:
    column, row = sparsity.get_ccs()
    data = np.ones(sparsity.nnz())
    return sparse.csc_matrix((data, row, column), shape=sparsity.shape)
