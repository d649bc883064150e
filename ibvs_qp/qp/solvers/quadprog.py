"""quadprog, the dual active-set method of Goldfarb and Idnani: exact to rounding, from scratch at every tick.

Source: Goldfarb and Idnani, A numerically stable dual method for solving strictly convex quadratic programs,
    Mathematical Programming 1983.
"""

from __future__ import annotations

import numpy as np
import quadprog  # pyright: ignore[reportMissingImports] -- from the extra "solvers"

from ibvs_qp.command import Outcome
from ibvs_qp.qp.solver import ProgramValues, Solution, Solver


class QuadprogSolver(Solver):
    """quadprog on the two-sided rows as two one-sided ones."""

    def _solve(self, values: ProgramValues, initial: np.ndarray | None) -> Solution:
        p, q, a, lower, upper = values
        rows = self.dense.rows(a)
        sides, bounds = np.vstack((rows, -rows)).T.copy(), np.concatenate((lower, -upper))
        try:
            x, _, _, iterations, multipliers, _ = quadprog.solve_qp(self.dense.hessian(p), -q, sides, bounds)
        except ValueError:  # no solution, or P is not positive definite
            return Solution(np.zeros(len(q)), np.zeros(len(lower)), None, 0)
        at_lower, at_upper = np.split(multipliers, 2)
        return Solution(x, at_upper - at_lower, Outcome.SOLVED, int(iterations[0]))


SOLVER = QuadprogSolver
