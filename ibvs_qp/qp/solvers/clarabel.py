"""Clarabel, an interior-point solver of cone programs, with one workspace for all ticks.

Source: Goulart and Chen, Clarabel: an interior-point solver for conic programs with quadratic objectives, 2024.
"""

# pyright: reportAttributeAccessIssue=false
from __future__ import annotations

import clarabel  # pyright: ignore[reportMissingImports] -- from the extra "solvers"
import numpy as np
from scipy import sparse

from ibvs_qp.command import Outcome
from ibvs_qp.qp.solver import ProgramValues, Solution, Solver

_OUTCOMES = {
    "Solved": Outcome.SOLVED,
    "AlmostSolved": Outcome.INACCURATE_ACCEPTED,
    "MaxIterations": Outcome.CAPPED_ACCEPTED,
}


class ClarabelSolver(Solver):
    """Clarabel on the two-sided rows as two one-sided ones."""

    def _solve(self, values: ProgramValues, initial: np.ndarray | None) -> Solution:
        p, q, a, lower, upper = values
        pattern = self.patterns.a_pattern
        rows = sparse.csc_matrix((a, pattern.indices, pattern.indptr), shape=pattern.shape)
        sides, bounds = sparse.csc_matrix(sparse.vstack((rows, -rows))), np.concatenate((upper, -lower))
        if self.workspace is None:
            settings = clarabel.DefaultSettings()
            settings.verbose, settings.presolve_enable, settings.max_iter = False, False, self.settings.max_iterations
            settings.tol_feas = settings.tol_gap_abs = self.gap_tolerance  # its residuals are relative to q and l, u
            settings.tol_gap_rel = 0.0
            hessian = sparse.csc_matrix((p, self.patterns.p_pattern.indices, self.patterns.p_pattern.indptr))
            cones = [clarabel.NonnegativeConeT(len(bounds))]
            self.workspace = clarabel.DefaultSolver(hessian, q, sides, bounds, cones, settings)
        else:
            self.workspace.update(P=p, q=q, A=sides.data, b=bounds)
        found = self.workspace.solve()
        at_upper, at_lower = np.split(np.array(found.z), 2)
        return Solution(np.array(found.x), at_upper - at_lower, _OUTCOMES.get(str(found.status)), found.iterations)


SOLVER = ClarabelSolver
