"""Tasks and limits to one program of fixed sparsity, condensed to thrusts and slacks, every row named."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
import numpy as np
from scipy import sparse

from ibvs_qp.limits.limit import Limit
from ibvs_qp.model.rows import LimitRow, SymbolicModel, TaskRow
from ibvs_qp.qp.row_check import check_rows
from ibvs_qp.tasks.task import Task


class AffineRows:
    r"""Rows :math:`r = J_a \dot\nu + J_u u + c` with the acceleration :math:`\dot\nu = G u + a_0` eliminated.

    Products go through the six accelerations, not through every row's thrusts: a third of the arithmetic.
    """

    def __init__(self, model: SymbolicModel, rows: ca.SX) -> None:
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

    def least_squares(self, weights: ca.SX, asked: ca.SX) -> tuple[ca.SX, ca.SX]:
        """Hessian J' W J, (n, n), and gradient J' W (c - asked), (n,)."""
        per_acceleration = self._model.acceleration_per_thrust
        ja, ju = self._by_acceleration, self._by_thrust
        weighted_a, weighted_u = ja.T @ ca.diag(weights), ju.T @ ca.diag(weights)
        cross = per_acceleration.T @ (weighted_a @ ju)
        by_acceleration = _symmetric_product(weighted_a, ja) @ per_acceleration
        hessian = _symmetric_product(per_acceleration.T, by_acceleration) + cross + cross.T + weighted_u @ ju
        offset = self.constant - asked
        return ca.densify(hessian), per_acceleration.T @ (weighted_a @ offset) + weighted_u @ offset


def _symmetric_product(left: ca.SX | ca.DM, right: ca.SX) -> ca.SX:
    """Product that is known to be symmetric: the upper triangle is worked out, the lower one is the same symbols."""
    size = left.shape[0]
    upper = ca.SX(size, size)
    for i in range(size):
        for j in range(i, size):
            upper[i, j] = left[i, :] @ right[:, j]
    return ca.triu2symm(upper)


class QpTemplate:
    r"""The program :math:`\min \tfrac12 x^T P x + q^T x,\; l \le A x \le u` with x = (thrusts, slacks).

    Accelerations are eliminated, soft equalities live in P: small, dense, well scaled (the form that keeps the
    tail of ADMM iterations short). P and A keep one sparsity for every phase, line count and fault.

    Attributes:
        variable_names: Names of the entries of x.
        task_names: Name and unit of every task row.
        row_names: Names of the rows of A.
        values: CasADi function of the stacked parameters giving (P, q, A, l, u) non-zeros, P as upper triangle.
        free: CasADi function of the stacked parameters giving the thrusts without limits and their worst violation.
        report: CasADi function (parameters, thrusts) giving achieved and asked of every task row, and weights.
        row_slack: Column of every row's slack in x, -1 where the row is hard, (rows,).

    Raises:
        ConfigError: When two rows share a name, or a row is not affine in the thrusts.
    """

    def __init__(self, model: SymbolicModel, tasks: Sequence[Task], limits: Sequence[Limit]) -> None:
        self.model = model
        self.task_rows: list[TaskRow] = [row for task in tasks for row in task.rows(model)]
        self.limit_rows: list[LimitRow] = [row for limit in limits for row in limit.rows(model)]
        check_rows(model, self.task_rows, self.limit_rows)
        places = [place for place, row in enumerate(self.limit_rows) if row.price is not None]
        soft = [self.limit_rows[place] for place in places]
        n, m = model.rotors, len(soft)
        weights = ca.vertcat(*(row.weight for row in self.task_rows))
        asked = ca.vertcat(*(row.target for row in self.task_rows))
        wishes = AffineRows(model, ca.vertcat(*(row.expression for row in self.task_rows)))
        bounds = AffineRows(model, ca.vertcat(*(row.expression for row in self.limit_rows)))
        hessian, gradient = wishes.least_squares(weights, asked)
        prices = ca.DM([float(row.price) for row in soft if row.price is not None]) if m else ca.DM(0, 1)
        p_upper = ca.triu(ca.diagcat(hessian, ca.SX(ca.diag(prices))) if m else hessian)
        q = ca.vertcat(gradient, ca.DM.zeros(m))
        slack = ca.DM.zeros(len(self.limit_rows), m)
        for column, place in enumerate(places):
            slack[place, column] = -1.0
        a = ca.horzcat(bounds.per_thrust, ca.sparsify(slack))
        lower = ca.vertcat(*(row.lower for row in self.limit_rows)) - bounds.constant
        upper = ca.vertcat(*(row.upper for row in self.limit_rows)) - bounds.constant
        stacked, u = ca.vertcat(*model.parameters.values()), model.thrust
        self.values = ca.Function(
            "qp_values", [stacked], [p_upper.nz[:], ca.densify(q), a.nz[:], ca.densify(lower), ca.densify(upper)]
        )
        self.free = ca.Function("free_optimum", [stacked], [*_free_optimum(hessian, gradient, bounds, lower, upper)])
        self.report = ca.Function("task_report", [stacked, u], [wishes.at(u), asked, weights])
        self.p_pattern, self.a_pattern = _pattern(p_upper.sparsity()), _pattern(a.sparsity())
        names = model.config.vehicle.geometry.names
        self.variable_names = tuple(f"thrust_{name}" for name in names) + tuple(f"slack_{row.name}" for row in soft)
        self.task_names = tuple((row.name, row.unit) for row in self.task_rows)
        self.row_names = tuple(row.name for row in self.limit_rows)
        self.row_units = tuple(row.unit for row in self.limit_rows)
        self.row_slack = np.full(len(self.limit_rows), -1)
        self.row_slack[places] = np.arange(n, n + m)
        self.layout = self._layout()

    def _layout(self) -> dict[str, slice]:
        layout, start = {}, 0
        for name, symbol in self.model.parameters.items():
            layout[name] = slice(start, start + symbol.numel())
            start += symbol.numel()
        return layout

    @property
    def parameter_count(self) -> int:
        """Length of the stacked parameter vector."""
        return sum(symbol.numel() for symbol in self.model.parameters.values())


def _free_optimum(hessian: ca.SX, gradient: ca.SX, rows: AffineRows, lower: ca.SX, upper: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Thrusts without any limit, by Cholesky factors, and by how much they would break the worst row (< 0: none).

    Where they break none, they are the solution of the program: no slack is worth taking. A maximum steps over
    not-a-number; where a bound is none, the violation is infinite.
    """
    root = ca.chol(hessian)
    thrusts = ca.solve(root, ca.solve(root.T, -gradient))
    at = rows.per_thrust @ thrusts
    worst = ca.fmax(ca.mmax(at - upper), ca.mmax(lower - at))
    bounded = ca.fabs(ca.sum1(thrusts) + ca.sum1(lower) + ca.sum1(upper)) < ca.inf
    return thrusts, ca.if_else(bounded, worst, ca.inf)


def _pattern(sparsity: ca.Sparsity) -> sparse.csc_matrix:
    column, row = sparsity.get_ccs()
    data = np.ones(sparsity.nnz())
    return sparse.csc_matrix((data, row, column), shape=sparsity.shape)
