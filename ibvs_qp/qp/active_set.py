"""The program solved exactly on a guess of the rows that bind: last tick's, or those where OSQP's iterates end."""

from __future__ import annotations

import math

import casadi as ca
import numpy as np

from ibvs_qp.model.bound_function import BoundFunction
from ibvs_qp.model.machine_code import machine_code
from ibvs_qp.qp.evaluator import ProgramData


class BufferedFunction(BoundFunction):
    def __init__(self, function: ca.Function, to_machine_code: bool = False) -> None:
        if to_machine_code:
            function = machine_code(function)
        self.inputs = [np.zeros(function.numel_in(i)) for i in range(function.n_in())]
        self.outputs = [np.zeros(function.numel_out(i)) for i in range(function.n_out())]
        super().__init__(function, self.inputs, self.outputs)


from ibvs_qp.qp.problem import QpProblem

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

    def __init__(self, template: QpProblem, to_machine_code: bool = False) -> None:
        self._dual = BufferedFunction(_dual_function(template), to_machine_code)
        rows, self._rotors = len(template.row_names), template.model.rotors
        _, self._coupling, self._per_row = self._dual.outputs
        self._at_free = self._dual.outputs[0]
        self._coupling, self._per_row = self._coupling.reshape(rows, rows), self._per_row.reshape(rows, -1)
        self.reset()

    def reset(self) -> None:
        """No row is taken for active."""
        self._take({})

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
        high, low = (data.upper - at < y).tolist(), (at - data.lower < -y).tolist()
        self._take({row: 1.0 if high[row] else -1.0 for row in range(len(at)) if high[row] or low[row]})
        return self._mend(data)

    def _evaluate(self, data: ProgramData) -> None:
        p, a, free = self._dual.inputs
        p[:], a[:], free[:] = data.p, data.a, data.free
        self._dual()

    def _take(self, sides: dict[int, float]) -> None:
        """A guess: rows in rising order, each with 1 where its upper bound binds and -1 where the lower one does."""
        self._sides, self._active = sides, np.array(list(sides), int)

    def _mend(self, data: ProgramData) -> tuple[np.ndarray, np.ndarray] | None:
        # A handful of rows: plain numbers where arrays cost ten times their arithmetic.
        lower, upper, at_free = data.lower.tolist(), data.upper.tolist(), self._at_free.tolist()
        for _ in range(ROUNDS):
            sides, active, prices, at = self._sides, self._active, _NONE, at_free
            if sides:
                rows = self._coupling.take(active, axis=0)
                beyond = [at[row] - (upper[row] if side > 0.0 else lower[row]) for row, side in sides.items()]
                try:
                    prices = np.linalg.solve(rows.take(active, axis=1), np.array(beyond))
                except np.linalg.LinAlgError:  # rows that depend on each other
                    return None
                at = (self._at_free - prices.dot(rows)).tolist()
            slip = TOLERANCE * (1.0 + max(max(at), -min(at)))
            if not math.isfinite(sum(at)):
                return None
            stays = self._pulling(prices)
            outside = _outside(at, lower, upper, slip)
            if not outside and len(stays) == len(sides):
                return self._solution(data, active, prices)
            self._take(_next_guess(outside, stays))
        self.reset()
        return None

    def _pulling(self, prices: np.ndarray) -> dict[int, float]:
        """The active rows whose multiplier does not pull the wrong way."""
        pulls = [price * side for price, side in zip(prices.tolist(), self._sides.values(), strict=True)]
        least = -TOLERANCE * (1.0 + max(map(abs, pulls), default=0.0))
        return {row: side for (row, side), pull in zip(self._sides.items(), pulls, strict=True) if pull >= least}

    def _solution(self, data: ProgramData, active: np.ndarray, found: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        prices = np.zeros(len(self._at_free))
        prices[active] = found
        x = -found.dot(self._per_row.take(active, axis=0))
        x[: self._rotors] += data.free
        return x, prices


def _outside(at: list[float], lower: list[float], upper: list[float], slip: float) -> dict[int, float]:
    """Rows beyond a bound: 1 above, -1 below, 0 where crossed bounds make it both."""
    found = {}
    for row, (value, low, high) in enumerate(zip(at, lower, upper, strict=True)):
        if value > high + slip or value < low - slip:
            found[row] = float((value > high + slip) - (value < low - slip))
    return found


def _next_guess(outside: dict[int, float], stays: dict[int, float]) -> dict[int, float]:
    """Rows that stay and rows that join, on the side of the bound they broke; crossed bounds bind nobody."""
    sides = stays | outside
    return {row: sides[row] for row in sorted(sides) if sides[row]}


def _dual_function(template: QpProblem) -> ca.Function:
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
