"""The solve of one tick: OSQP, acceptance test, DAQP where the test fails."""

from __future__ import annotations

import math

import numpy as np

from ibvs_qp.command import Outcome
from ibvs_qp.config import SolverSettings
from ibvs_qp.qp.compiled import CompiledSolver, compiled_solver
from ibvs_qp.qp.evaluator import ProgramData
from ibvs_qp.qp.exact import ExactSolver
from ibvs_qp.qp.infeasible import conflicting_rows
from ibvs_qp.qp.osqp import MAX_ITERATIONS, SOLVED, SOLVED_INACCURATE, OsqpSolver, RawSolution
from ibvs_qp.qp.problem import QpProblem
from ibvs_qp.qp.solution import ACTIVE_MULTIPLIER, BOUND_SLIP, AcceptedSolution, Tried

#: Outcome by OSQP's status; with any other status the iterate means nothing.
OUTCOMES = {
    SOLVED: Outcome.SOLVED,
    SOLVED_INACCURATE: Outcome.INACCURATE_ACCEPTED,
    MAX_ITERATIONS: Outcome.CAPPED_ACCEPTED,
}


class QpEngine:
    """OSQP at every tick; DAQP in the same tick where OSQP's answer fails the acceptance test.

    OSQP starts from the last solution, after a tick without an active limit from this tick's solution without rows.

    Attributes:
        data: Values of the program.
        conflict: Names of a smallest set of hard rows that contradict each other, after a solve without a solution.
    """

    STATE = ("conflict", "_limited")

    def __init__(self, problem: QpProblem, settings: SolverSettings, data: ProgramData) -> None:
        self.problem, self.settings, self.data = problem, settings, data
        compiled = compiled_solver(problem, settings, data) if settings.backend == "compiled" else None
        self.osqp: OsqpSolver | CompiledSolver = compiled or OsqpSolver(problem, settings)
        self.exact = ExactSolver(problem)
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
        if isinstance(self.osqp, CompiledSolver):
            accepted, tried = self.osqp.solve()
        else:
            accepted, tried = self._interpreted(self.osqp)
        if accepted is not None or tried is None:
            return accepted
        exact = self.exact.solve(*self._program)
        if exact is not None:
            self.osqp.warm_start(*exact)
            return self._accepted(*exact, Outcome.EXACT_FALLBACK, tried)
        self.conflict = conflicting_rows(self.problem, self.data)
        self.reset()
        return None

    def _interpreted(self, solver: OsqpSolver) -> tuple[AcceptedSolution | None, Tried | None]:
        raw = solver.solve(*self._program, initial=None if self._limited else self.data.unlimited)
        if raw is None:
            return None, None
        tried, outcome = Tried(raw.iterations, raw.seconds), self.accepts(raw)
        return None if outcome is None else self._accepted(raw.x, raw.y, outcome, tried), tried

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

    def _accepted(self, x: np.ndarray, y: np.ndarray, outcome: Outcome, tried: Tried) -> AcceptedSolution:
        thrusts = np.minimum(np.maximum(x[: self._rotors], self._lower), self._upper)
        self._limited = max(map(abs, y.tolist())) > ACTIVE_MULTIPLIER
        return AcceptedSolution(thrusts, x, y, outcome, *tried, self._limited)
