"""ProxQP, a primal-dual proximal augmented Lagrangian solver, with one workspace for all ticks.

Source: Bambade, El-Kazdadi, Taylor and Carpentier, ProxQP: yet another quadratic programming solver for robotics and
    beyond, Robotics: Science and Systems 2022.
"""

from __future__ import annotations

import numpy as np
from proxsuite import proxqp  # pyright: ignore[reportMissingImports] -- from the extra "solvers"

from ibvs_qp.command import Outcome
from ibvs_qp.qp.solver import ProgramValues, Solution, Solver

_OUTCOMES = {
    proxqp.QPSolverOutput.PROXQP_SOLVED: Outcome.SOLVED,
    proxqp.QPSolverOutput.PROXQP_MAX_ITER_REACHED: Outcome.CAPPED_ACCEPTED,
}


class ProxqpSolver(Solver):
    """ProxQP from the last solution."""

    def _solve(self, values: ProgramValues, initial: np.ndarray | None) -> Solution:
        p, q, a, lower, upper = values
        data = self.dense.hessian(p), q, None, None, self.dense.rows(a), lower, upper
        if self.workspace is None:
            self.workspace = proxqp.dense.QP(len(q), 0, len(lower))
            settings = self.workspace.settings
            settings.eps_abs, settings.eps_rel = self.settings.tolerance, self.settings.relative_tolerance
            settings.max_iter = self.settings.max_iterations
            settings.initial_guess = proxqp.InitialGuess.WARM_START
            self.workspace.init(*data)
        else:
            self.workspace.update(*data)
        x, y = (initial, None) if initial is not None else self.start or (None, None)
        self.workspace.solve(x, None, np.zeros(len(lower)) if y is None else y)
        found = self.workspace.results
        self.start = x, y = found.x.copy(), found.z.copy()
        return Solution(x, y, _OUTCOMES.get(found.info.status), found.info.iter)


SOLVER = ProxqpSolver
