"""DAQP through CasADi: the exact fallback in flight and the oracle of the tests."""

from __future__ import annotations

import casadi as ca
import numpy as np

from ibvs_qp.qp.problem import ProgramPatterns

#: Largest violation of a row in an accepted solution: DAQP skips rows that are all zero.
FEASIBLE = 1e-4


class ExactSolver:
    """Dual active-set solver of the same program; exact to rounding, called only when OSQP is not accepted."""

    def __init__(self, problem: ProgramPatterns) -> None:
        self._problem = problem
        p_sparsity = _casadi_sparsity(problem.p_pattern + problem.p_pattern.T)
        self._p_sparsity, self._a_sparsity = p_sparsity, _casadi_sparsity(problem.a_pattern)
        self._solver = ca.conic("exact", "daqp", {"h": p_sparsity, "a": self._a_sparsity}, {"error_on_fail": False})

    def solve(
        self, p: np.ndarray, q: np.ndarray, a: np.ndarray, lower: np.ndarray, upper: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray] | None:
        """Solution and multipliers (y > 0 at an upper bound), or None without success."""
        upper_triangle = self._problem.p_pattern.copy()
        upper_triangle.data = p.copy()
        full = upper_triangle.toarray()
        full = full + np.triu(full, 1).T
        matrix = self._problem.a_pattern.copy()
        matrix.data = a.copy()
        hessian = ca.project(ca.DM(full), self._p_sparsity)
        rows = ca.project(ca.DM(matrix.toarray()), self._a_sparsity)
        try:
            result = self._solver(h=hessian, g=q, a=rows, lba=lower, uba=upper)
        except RuntimeError:
            return None
        x, y = np.array(result["x"]).ravel(), np.array(result["lam_a"]).ravel()
        if not self._solver.stats().get("success", False) or not np.isfinite(x.sum() + y.sum()):
            return None
        at = matrix @ x
        return (x, y) if float(np.maximum(lower - at, at - upper).max()) <= FEASIBLE else None


def _casadi_sparsity(pattern: object) -> ca.Sparsity:
    matrix = pattern.tocsc()  # type: ignore[attr-defined]
    matrix.sort_indices()
    rows, columns = matrix.shape
    return ca.Sparsity(rows, columns, matrix.indptr.tolist(), matrix.indices.tolist())
