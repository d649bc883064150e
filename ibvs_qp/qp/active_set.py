"""The program solved exactly on a guess of the rows that bind: last tick's, or those where OSQP's iterates end."""

from __future__ import annotations

import math

import casadi as ca
import numpy as np

from ibvs_qp.qp.assembly import QpTemplate
from ibvs_qp.qp.evaluator import BufferedFunction, ProgramData

#: A row may lie outside its bounds by this much, and a multiplier on the wrong side of zero, relative to the largest.
TOLERANCE = 1e-7
#: A guess of the active rows is mended this often before it is given up.
ROUNDS = 6

_NONE = np.zeros(0)


class ActiveSet:
    r"""Solutions that meet the optimality conditions to rounding, from a guess of the active rows.

    With the guessed rows as equalities

    .. math::
        x = x_0 - P^{-1} A_a^T y_a, \quad A_a P^{-1} A_a^T y_a = A_a x_0 - b_a, \quad x_0 = -P^{-1} q.

    A row that this violates joins, one that pulls the wrong way leaves, and when there is neither it is THE solution
    (P is positive definite), whatever made the guess. OSQP 1.1 has a polishing step too, but prints a line every tick.

    Source: Nocedal and Wright, Numerical Optimization, 2nd edition, sections 16.2 and 16.5.
    """

    def __init__(self, template: QpTemplate, to_machine_code: bool = False) -> None:
        self._dual = BufferedFunction(_dual_function(template), to_machine_code)
        rows, self._rotors = len(template.row_names), template.model.rotors
        _, self._coupling, self._per_row = self._dual.outputs
        self._at_free = self._dual.outputs[0]
        self._coupling, self._per_row = self._coupling.reshape(rows, rows), self._per_row.reshape(rows, -1)
        self.reset()

    def reset(self) -> None:
        """No row is taken for active."""
        self._active, self._sides = np.zeros(0, int), np.zeros(0)

    def solve(self, data: ProgramData) -> tuple[np.ndarray, np.ndarray] | None:
        """Solution and multipliers from the rows active last, or None if they cannot be mended.

        Args:
            data: The program and its optimum without limits, all finite.

        Returns:
            (variables,) and (rows,), multipliers > 0 at an upper bound.
        """
        self._evaluate(data)
        return self._mend(data)

    def solve_near(self, data: ProgramData, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
        """Likewise from a nearly optimal point: a row counts as active where its multiplier exceeds its distance.

        Source: Stellato et al., OSQP, Mathematical Programming Computation 2020, section 5.2.
        """
        self._evaluate(data)
        at = data.rows() @ x
        self._take(data.upper - at < y, at - data.lower < -y)
        return self._mend(data)

    def _evaluate(self, data: ProgramData) -> None:
        p, a, free = self._dual.inputs
        p[:], a[:], free[:] = data.p, data.a, data.free
        self._dual()

    def _take(self, high: np.ndarray, low: np.ndarray) -> None:
        self._active = (high | low).nonzero()[0]
        self._sides = np.where(high, 1.0, -1.0)[self._active]

    def _mend(self, data: ProgramData) -> tuple[np.ndarray, np.ndarray] | None:
        lower, upper = data.lower, data.upper
        for _ in range(ROUNDS):
            active, sides, at, prices = self._active, self._sides, self._at_free, _NONE
            if len(active):
                rows = self._coupling[active]
                beyond = at[active] - np.where(sides > 0.0, upper[active], lower[active])
                try:
                    prices = np.linalg.solve(rows[:, active], beyond)
                except np.linalg.LinAlgError:  # rows that depend on each other
                    return None
                at = at - prices @ rows
            slip = TOLERANCE * (1.0 + max(at.max(), -at.min()))
            if not slip < math.inf:  # not a number, too
                return None
            pulls = prices * sides
            wrong = pulls < -TOLERANCE * (1.0 + abs(pulls).max()) if len(active) else pulls > 0.0
            above, below = at > upper + slip, at < lower - slip
            if not (wrong.any() or (above | below).any()):
                return self._solution(data, active, prices)
            high, low = above, below
            stays = active[~wrong]
            high[stays[sides[~wrong] > 0.0]] = True
            low[stays[sides[~wrong] < 0.0]] = True
            self._take(high & ~below, low & ~above)
        self.reset()
        return None

    def _solution(self, data: ProgramData, active: np.ndarray, found: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        prices = np.zeros(len(self._at_free))
        prices[active] = found
        x = -(found @ self._per_row[active])
        x[: self._rotors] += data.free
        return x, prices


def _dual_function(template: QpTemplate) -> ca.Function:
    """(P, A, free thrusts) to rows at the free optimum, A P^-1 A' and A P^-1, P being block diagonal."""
    n = template.model.rotors
    p, a = (
        ca.SX.sym(name, _sparsity(pattern)) for name, pattern in (("p", template.p_pattern), ("a", template.a_pattern))
    )
    free = ca.SX.sym("free", n)
    rows, slack = a[:, :n], a[:, n:]
    root = ca.chol(ca.triu2symm(p[:n, :n]))
    half = ca.solve(root.T, rows.T)
    slack_per_row = slack @ ca.diag(1.0 / ca.diag(p[n:, n:]))
    coupling = half.T @ half + slack_per_row @ slack.T
    per_row = ca.horzcat(ca.solve(root, half).T, slack_per_row)
    # CasADi counts column by column, numpy row by row.
    results = [rows @ free, coupling, per_row.T]
    return ca.Function("dual", [p.nz[:], a.nz[:], free], [ca.densify(result) for result in results])


def _sparsity(pattern: object) -> ca.Sparsity:
    matrix = pattern.tocsc()  # type: ignore[attr-defined]
    rows, columns = matrix.shape
    return ca.Sparsity(rows, columns, matrix.indptr.tolist(), matrix.indices.tolist())
