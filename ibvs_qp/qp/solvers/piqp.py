"""PIQP, a proximal interior-point solver, with one workspace for all ticks.

Source: Schwan, Jiang, Kuhn and Jones, PIQP: a proximal interior-point quadratic programming solver, IEEE Conference on
    Decision and Control 2023.
"""

from __future__ import annotations

import numpy as np
import piqp  # pyright: ignore[reportMissingImports] -- from the extra "solvers"

from ibvs_qp.command import Outcome
from ibvs_qp.qp.solver import ProgramValues, Solution, Solver

_OUTCOMES = {piqp.PIQP_SOLVED: Outcome.SOLVED, piqp.PIQP_MAX_ITER_REACHED: Outcome.CAPPED_ACCEPTED}


class PiqpSolver(Solver):
    """PIQP; an interior-point method starts from its own point at every tick."""

    def _solve(self, values: ProgramValues, initial: np.ndarray | None) -> Solution:
        p, q, a, lower, upper = values
        hessian, rows = np.asfortranarray(self.dense.hessian(p)), np.asfortranarray(self.dense.rows(a))
        data = hessian, q, None, None, rows, lower, upper
        if self.workspace is None:
            self.workspace = piqp.DenseSolver()
            settings = self.workspace.settings
            settings.eps_abs, settings.eps_rel = self.settings.tolerance, self.settings.relative_tolerance
            settings.eps_duality_gap_abs, settings.eps_duality_gap_rel = self.gap_tolerance, 0.0
            settings.max_iter = self.settings.max_iterations
            self.workspace.setup(*data)
        else:
            self.workspace.update(*data)
        status, found = self.workspace.solve(), self.workspace.result
        return Solution(found.x.copy(), found.z_u - found.z_l, _OUTCOMES.get(status), found.info.iter)


SOLVER = PiqpSolver
