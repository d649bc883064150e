"""The program through any back end of qpsolvers, for comparisons and replays; in flight it would cost too much."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import qpsolvers
from scipy import sparse

from ibvs_qp.config.errors import IbvsQpError
from ibvs_qp.qp.problem import ProgramData, QpProblem

#: Back ends that take dense matrices only.
DENSE = ("daqp", "quadprog")


def installed_solvers() -> tuple[str, ...]:
    """Names of the back ends that qpsolvers finds on this machine."""
    return tuple(sorted(qpsolvers.available_solvers))


def qpsolvers_problem(problem: QpProblem, data: ProgramData, dense: bool = False) -> qpsolvers.Problem:
    """One tick's program in the form of qpsolvers: full P, two-sided rows stacked as G x <= h.

    Args:
        problem: Patterns of the matrices.
        data: Their values.
        dense: Arrays instead of sparse matrices.
    """
    upper_triangle, rows = problem.p_pattern.copy(), problem.a_pattern.copy()
    upper_triangle.data, rows.data = data.p.copy(), data.a.copy()
    hessian = sparse.csc_matrix(upper_triangle + sparse.triu(upper_triangle, 1).T)
    stacked = sparse.csc_matrix(sparse.vstack((rows, -rows)))
    bounds = np.concatenate((data.upper, -data.lower))
    if dense:
        return qpsolvers.Problem(hessian.toarray(), data.q.copy(), stacked.toarray(), bounds)
    return qpsolvers.Problem(hessian, data.q.copy(), stacked, bounds)


def solve_offline(
    problem: QpProblem, data: ProgramData, solver: str, **options: Any
) -> tuple[np.ndarray, np.ndarray] | None:
    """Solution and multipliers of one tick's program by a back end of qpsolvers.

    Args:
        problem: Patterns of the matrices.
        data: Their values.
        solver: Name of the back end, as in `installed_solvers`.
        options: Passed on to it, as in ``eps_abs=1e-9``.

    Returns:
        (variables,) and (rows,), multipliers > 0 at an upper bound; None if it found none.

    Raises:
        IbvsQpError: When there is no such back end here.

    Source: qpsolvers' documentation, "Quadratic programming" and "Supported solvers".
    """
    if solver not in qpsolvers.available_solvers:
        raise IbvsQpError(f"solver {solver!r} is not installed; there are {', '.join(installed_solvers())}")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # some warn that a sparse matrix is made dense
        found = qpsolvers.solve_problem(
            qpsolvers_problem(problem, data, dense=solver in DENSE), solver=solver, **options
        )
    if not found.found or found.x is None or found.z is None:
        return None
    count = len(data.lower)
    return found.x, found.z[:count] - found.z[count:]
