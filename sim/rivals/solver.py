"""OSQP with DAQP behind it, for programs of any sparsity."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from ibvs_qp.command import Outcome
from ibvs_qp.config import SolverSettings
from ibvs_qp.qp.exact import ExactSolver
from ibvs_qp.qp.solvers.osqp import OsqpSolver


@dataclass
class Patterns:
    """Sparsity of a program: upper triangle of P, and A."""

    p_pattern: sparse.csc_matrix
    a_pattern: sparse.csc_matrix


class BackedSolver:
    """A workspace of OSQP, and DAQP in the same tick where OSQP finds no solution.

    Attributes:
        iterations, seconds, outcome: Of the last solve.
    """

    def __init__(self, p_pattern: sparse.csc_matrix, a_pattern: sparse.csc_matrix, settings: SolverSettings) -> None:
        patterns = Patterns(p_pattern, a_pattern)
        self.solver, self._exact = OsqpSolver(patterns, settings), ExactSolver(patterns)
        self.iterations, self.seconds, self.outcome = 0, 0.0, Outcome.SOLVED

    def solve(
        self, p: np.ndarray, q: np.ndarray, a: np.ndarray, lower: np.ndarray, upper: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray] | None:
        """Solution and multipliers, or None if neither solver has one; arguments as of `OsqpSolver.solve`."""
        raw = self.solver.solve(p, q, a, lower, upper)
        if raw is None:
            return None
        self.iterations, self.seconds = raw.iterations, raw.seconds
        if raw.status is Outcome.SOLVED:
            self.outcome = Outcome.SOLVED
            return raw.x, raw.y
        self.outcome = Outcome.EXACT_FALLBACK
        exact = self._exact.solve(p, q, a, lower, upper)
        if exact is None:
            self.solver.reset()
        else:
            self.solver.warm_start(exact.x, exact.y)
        return None if exact is None else (exact.x, exact.y)
