"""DAQP, a dual active-set solver: exact to rounding, with one workspace for all ticks.

Source: Arnström, Bemporad and Axehill, A dual active-set solver for embedded quadratic programming using recursive
    LDL' updates, IEEE Transactions on Automatic Control 2022.
"""

from __future__ import annotations

import daqp  # pyright: ignore[reportMissingImports] -- from the extra "solvers"
import numpy as np

from ibvs_qp.command import Outcome
from ibvs_qp.qp.solver import ProgramValues, Solution, Solver


class DaqpSolver(Solver):
    """DAQP from the active set of the last solution, or from none."""

    def _solve(self, values: ProgramValues, initial: np.ndarray | None) -> Solution:
        p, q, a, lower, upper = values
        hessian, rows = self.dense.hessian(p), self.dense.rows(a)
        if self.workspace is None:
            self.workspace = daqp.Model()
            self.workspace.setup(hessian, q, rows, upper, lower)
        else:
            fresh = None if initial is None else np.zeros(len(lower), np.int32)
            self.workspace.update(hessian, q, rows, upper, lower, fresh)
        x, _, status, info = self.workspace.solve()
        return Solution(x, info["lam"], Outcome.SOLVED if status == 1 else None, info["iterations"])


SOLVER = DaqpSolver
