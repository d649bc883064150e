"""DAQP through CasADi: the exact fallback in flight and the oracle of the tests."""

from __future__ import annotations

import casadi as ca
import numpy as np

from ibvs_qp.command import Outcome
from ibvs_qp.config import SolverSettings
from ibvs_qp.qp.solver import ProgramPatterns, ProgramValues, Solution, Solver

#: Largest violation of a row in a solution: DAQP skips rows that are all zero.
FEASIBLE = 1e-4


class ExactSolver(Solver):
    """Dual active-set solver of the same program; exact to rounding, called only when the first is not accepted."""

    def __init__(self, patterns: ProgramPatterns) -> None:
        super().__init__(patterns, SolverSettings())
        sparsity = {"h": _sparsity(patterns.p_pattern + patterns.p_pattern.T), "a": _sparsity(patterns.a_pattern)}
        self.workspace = ca.conic("exact", "daqp", sparsity, {"error_on_fail": False})
        self._p_sparsity, self._a_sparsity = sparsity.values()

    def reset(self) -> None:
        """Nothing is carried from tick to tick."""

    def _solve(self, values: ProgramValues, initial: np.ndarray | None) -> Solution | None:
        p, q, a, lower, upper = values
        matrix = self.dense.rows(a)
        hessian = ca.project(ca.DM(self.dense.hessian(p)), self._p_sparsity)
        rows = ca.project(ca.DM(matrix), self._a_sparsity)
        try:
            result = self.workspace(h=hessian, g=q, a=rows, lba=lower, uba=upper)
        except RuntimeError:
            return None
        x, y = np.array(result["x"]).ravel(), np.array(result["lam_a"]).ravel()
        if not self.workspace.stats().get("success", False) or not np.isfinite(x.sum() + y.sum()):
            return None
        at = matrix @ x
        return Solution(x, y, Outcome.SOLVED, 0) if np.maximum(lower - at, at - upper).max() <= FEASIBLE else None


def _sparsity(pattern: object) -> ca.Sparsity:
    matrix = pattern.tocsc()  # type: ignore[attr-defined]
    matrix.sort_indices()
    rows, columns = matrix.shape
    return ca.Sparsity(rows, columns, matrix.indptr.tolist(), matrix.indices.tolist())
