"""What the solution of a tick is compared with: the exact solution, its active limits, the optimality conditions."""

from __future__ import annotations

import numpy as np

from ibvs_qp.controller import HybridController
from ibvs_qp.qp.problem import ProgramData
from ibvs_qp.qp.solver import ACTIVE_MULTIPLIER, AcceptedSolution

#: Largest thrust difference to the exact solution on limited ticks and on all others [N].
LIMITED_N, FREE_N = 2e-2, 1e-3


def exact(controller: HybridController) -> tuple[np.ndarray, np.ndarray]:
    """Solution and multipliers of the controller's program by DAQP."""
    data = controller.engine.data
    found = controller.engine.exact.solve(data.p, data.q, data.a, data.lower, data.upper)
    assert found is not None
    return found.x, found.y


def check_active(names: set[str], controller: HybridController, y: np.ndarray) -> None:
    """The limits named are those of the exact multipliers; within a factor of two of the threshold either will do."""
    size = dict(zip(controller.problem.row_names, np.abs(y), strict=True))
    assert {name for name, value in size.items() if value > 2.0 * ACTIVE_MULTIPLIER} <= names
    assert names <= {name for name, value in size.items() if value > 0.5 * ACTIVE_MULTIPLIER}


def stationarity(data: ProgramData, solution: AcceptedSolution) -> float:
    """Largest entry of P^-1 (P x + q + A' y) [N]."""
    gradient = data.hessian() @ solution.x + data.q + data.rows().T @ solution.y
    return float(np.abs(np.linalg.solve(data.hessian(), gradient)).max())
