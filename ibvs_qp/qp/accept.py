"""The solve of one tick: OSQP, acceptance test, DAQP where the test fails."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ibvs_qp.command import Outcome
from ibvs_qp.config import SolverSettings
from ibvs_qp.qp.evaluator import ProgramData
from ibvs_qp.qp.exact import ExactSolver
from ibvs_qp.qp.infeasible import conflicting_rows
from ibvs_qp.qp.osqp import MAX_ITERATIONS, SOLVED, SOLVED_INACCURATE, OsqpSolver, RawSolution
from ibvs_qp.qp.problem import QpProblem

#: Outcome by OSQP's status; with any other status the iterate means nothing.
OUTCOMES = {
    SOLVED: Outcome.SOLVED,
    SOLVED_INACCURATE: Outcome.INACCURATE_ACCEPTED,
    MAX_ITERATIONS: Outcome.CAPPED_ACCEPTED,
}
#: A row whose multiplier exceeds this is active [cost per unit of the row]. OSQP projects on the bounds, so a free row
#: has a multiplier of 1e-12 at most; where a row is just touched, its multiplier is uncertain by about `tolerance`
#: times the coupling between rows, 1e-4.
ACTIVE_MULTIPLIER = 1e-3
#: Largest violation of a hard row in a solved program [N of thrust]; thrusts are clipped to their bounds.
BOUND_SLIP = 1e-2


@dataclass(slots=True)
class AcceptedSolution:
    """Thrusts within their bounds (n,), primal x, multipliers y, how they were found, and whether a row is active."""

    thrusts: np.ndarray
    x: np.ndarray
    y: np.ndarray
    outcome: Outcome
    iterations: int
    seconds: float
    limited: bool


class QpEngine:
    """OSQP at every tick; DAQP in the same tick where OSQP's answer fails the acceptance test.

    OSQP starts from the last solution, after a tick without an active limit from this tick's solution without limits.

    Attributes:
        data: Values of the program.
        conflict: Names of a smallest set of hard rows that contradict each other, after a solve without a solution.
    """

    def __init__(self, problem: QpProblem, settings: SolverSettings, data: ProgramData) -> None:
        self.problem, self.settings, self.data = problem, settings, data
        self.osqp, self.exact = OsqpSolver(problem, settings), ExactSolver(problem)
        self._rotors = n = problem.model.rotors
        self._program = data.p, data.q, data.a, data.lower, data.upper
        self._lower, self._upper = data.lower[:n], data.upper[:n]
        self._hard = np.flatnonzero(problem.row_slack[n:] < 0) + n
        self.conflict, self._limited = (), False

    def reset(self) -> None:
        """As after construction."""
        self.osqp.reset()
        self._limited = False

    def solve(self) -> AcceptedSolution | None:
        """Solve the program of this tick; None if neither solver has a solution."""
        self.conflict = ()
        raw = self.osqp.solve(*self._program, initial=None if self._limited else self.data.unlimited)
        if raw is None:
            return None
        outcome = self.accepts(raw)
        if outcome is not None:
            return self._accepted(raw.x, raw.y, outcome, raw)
        exact = self.exact.solve(*self._program)
        if exact is not None:
            self.osqp.warm_start(*exact)
            return self._accepted(*exact, Outcome.EXACT_FALLBACK, raw)
        self.conflict = conflicting_rows(self.problem, self.data)
        self.reset()
        return None

    def accepts(self, raw: RawSolution) -> Outcome | None:
        """Acceptance test: status, finiteness, bounds, residuals; None if the answer fails it.

        The status comes first: the iterate of an infeasible program is 2143289344.0, a finite number.
        """
        outcome = OUTCOMES.get(raw.status)
        if outcome is None or not math.isfinite(raw.x.dot(raw.x) + raw.y.dot(raw.y)):
            return None
        slip = self.primal_residual(raw.x)
        if outcome is Outcome.SOLVED:
            return outcome if slip <= BOUND_SLIP else None
        largest = self.settings.accept_residual
        return outcome if slip <= largest and self.dual_residual(raw.x, raw.y) <= largest else None

    def primal_residual(self, x: np.ndarray) -> float:
        """Largest violation of a hard row [N of thrust]."""
        n, data = self._rotors, self.data
        bounds = zip(x[:n].tolist(), self._lower.tolist(), self._upper.tolist(), strict=True)
        slip = max([low - thrust if thrust < low else thrust - high for thrust, low, high in bounds])
        if len(self._hard):  # barriers without slack
            rows = data.rows()[self._hard, :n]
            at, unit_per_newton = rows @ x[:n], np.linalg.norm(rows, axis=1)
            beyond = np.maximum(data.lower[self._hard] - at, at - data.upper[self._hard])
            slip = max(slip, float((beyond / np.where(unit_per_newton > 0.0, unit_per_newton, 1.0)).max()))
        return slip

    def dual_residual(self, x: np.ndarray, y: np.ndarray) -> float:
        """Largest entry of P^-1 (P x + q + A' y) [N]: the residual as a thrust, also along the soft directions of P."""
        data = self.data
        return float(np.abs(x + np.linalg.solve(data.hessian(), data.q + data.rows().T @ y)).max())

    def _accepted(self, x: np.ndarray, y: np.ndarray, outcome: Outcome, raw: RawSolution) -> AcceptedSolution:
        thrusts = np.minimum(np.maximum(x[: self._rotors], self._lower), self._upper)
        self._limited = max(map(abs, y.tolist())) > ACTIVE_MULTIPLIER
        return AcceptedSolution(thrusts, x, y, outcome, raw.iterations, raw.seconds, self._limited)
