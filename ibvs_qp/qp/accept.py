"""The solve of one tick: the chosen solver, acceptance test, DAQP where the test fails."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ibvs_qp.command import Outcome
from ibvs_qp.config import SolverSettings
from ibvs_qp.qp.exact import ExactSolver
from ibvs_qp.qp.infeasible import conflicting_rows
from ibvs_qp.qp.problem import ProgramData, QpProblem
from ibvs_qp.qp.solver import ACTIVE_MULTIPLIER, BOUND_SLIP, AcceptedSolution, Solution, Tried, make_solver


class QpEngine:
    """The solver of the settings at every tick; DAQP in the same tick where its answer fails the acceptance test.

    The solver starts from the last solution, after a tick without an active limit from this tick's solution without
    rows.

    Attributes:
        data: Values of the program.
        solver: The solver that is tried first; the compiled one has the acceptance test inside.
        conflict: Names of a smallest set of hard rows that contradict each other, after a solve without a solution.
    """

    STATE = ("conflict", "_limited")

    def __init__(self, problem: QpProblem, settings: SolverSettings, data: ProgramData) -> None:
        self.problem, self.settings, self.data = problem, settings, data
        compiled = None
        if settings.backend == "compiled":
            from ibvs_qp.qp.compiled import compiled_solver

            compiled = compiled_solver(problem, settings, data)
        self.solver: Any = compiled or make_solver(problem, settings)  # a Solver, or the one with the test inside
        self._try = compiled.solve if compiled else self._in_python
        self.exact = ExactSolver(problem)
        self._rotors = n = problem.model.rotors
        self._program = data.p, data.q, data.a, data.lower, data.upper
        self._lower, self._upper = data.lower[:n], data.upper[:n]
        self._hard = np.flatnonzero(problem.row_slack[n:] < 0) + n
        self.conflict, self._limited = (), False

    def reset(self) -> None:
        """As after construction."""
        self.solver.reset()
        self._limited = False

    def solve(self) -> AcceptedSolution | None:
        """Solve the program of this tick; None if neither solver has a solution."""
        self.conflict = ()
        accepted, tried = self._try()
        if accepted is not None or tried is None:
            return accepted
        exact = self.exact.solve(*self._program)
        if exact is not None:
            self.solver.warm_start(exact.x, exact.y)
            return self._accepted(exact, Outcome.EXACT_FALLBACK, tried)
        self.conflict = conflicting_rows(self.problem, self.data)
        self.reset()
        return None

    def _in_python(self) -> tuple[AcceptedSolution | None, Tried | None]:
        found = self.solver.solve(*self._program, initial=None if self._limited else self.data.unlimited)
        if found is None:
            return None, None
        tried, outcome = Tried(found.iterations, found.seconds), self.accepts(found)
        return None if outcome is None else self._accepted(found, outcome, tried), tried

    def accepts(self, found: Solution) -> Outcome | None:
        """Acceptance test: status, finiteness, bounds, residuals; None if the answer fails it.

        The status comes first: the iterate of an infeasible program is 2143289344.0 in OSQP, a finite number. The dual
        residual of a solved program is not computed again where the solver has tested it (`Solver.tests_residuals`).
        """
        x, y, outcome = found.x, found.y, found.status
        if outcome is None or not math.isfinite(x.dot(x) + y.dot(y)):
            return None
        slip, largest = self.primal_residual(x), self.settings.accept_residual
        tested = self.solver.tests_residuals
        if outcome is Outcome.SOLVED and tested:
            return outcome if slip <= BOUND_SLIP else None
        complementary = tested or self.distance_of_active_rows(x, y) <= largest
        return outcome if slip <= largest and self.dual_residual(x, y) <= largest and complementary else None

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

    def distance_of_active_rows(self, x: np.ndarray, y: np.ndarray) -> float:
        """Largest distance of a row from the bound that its multiplier states [N of thrust or unit of slack]."""
        rows, data = self.data.rows(), self.data
        away = np.where(y > 0.0, data.upper - rows @ x, rows @ x - data.lower) / np.linalg.norm(rows, axis=1)
        return float(away[np.abs(y) > ACTIVE_MULTIPLIER].max(initial=0.0))

    def _accepted(self, found: Solution, outcome: Outcome, tried: Tried) -> AcceptedSolution:
        x, y = found.x, found.y
        thrusts = np.minimum(np.maximum(x[: self._rotors], self._lower), self._upper)
        self._limited = max(map(abs, y.tolist())) > ACTIVE_MULTIPLIER
        return AcceptedSolution(thrusts, x, y, outcome, *tried, self._limited)
