"""OSQP with one persistent workspace: values updated in place, warm started, every trap guarded."""

from __future__ import annotations

import os
import signal
import threading
from typing import Any

import numpy as np
import osqp

from ibvs_qp.command import Outcome
from ibvs_qp.config import SolverSettings
from ibvs_qp.qp.solver import ProgramPatterns, ProgramValues, Solution, Solver

#: Outcome by the status of OSQP 1.x; with any other status the iterate means nothing.
OUTCOMES = {1: Outcome.SOLVED, 2: Outcome.INACCURATE_ACCEPTED, 7: Outcome.CAPPED_ACCEPTED}
#: Status of a solve that Ctrl-C ended: OSQP replaces the signal's handler meanwhile.
INTERRUPTED = 10


class OsqpSolver(Solver):
    """OSQP with one workspace for all ticks.

    Guards, each against a behaviour reproduced on OSQP 1.1: non-finite data is refused, because one NaN stays in the
    warm start; l > u is refused, because such an update is dropped silently; strided arrays are copied and wrong
    lengths refused, because neither is checked; set-up receives private copies, because updates write into its
    matrices; a reset sets up anew, because the adapted rho survives; Ctrl-C during a solve is raised again, because
    OSQP swallows it. The limits keep l and u at least 1e-4 apart; any closer, OSQP would turn the row into an equality
    and factorise again.
    """

    tests_residuals = True

    def __init__(self, patterns: ProgramPatterns, settings: SolverSettings) -> None:
        super().__init__(patterns, settings)
        self._no_multipliers = np.zeros(self._lengths[-1])
        self._iterate = np.zeros(self._lengths[1]), self._no_multipliers

    def _setup(self, values: ProgramValues) -> osqp.OSQP:
        p, q, a, lower, upper = values
        p_matrix, a_matrix = self.patterns.p_pattern.copy(), self.patterns.a_pattern.copy()
        p_matrix.data, a_matrix.data = p.copy(), a.copy()
        solver = osqp.OSQP()
        settings = {"verbose": False, "warm_starting": True} | osqp_settings(self.settings)
        if self.start is not None:
            settings["rho"] = self.start[2]
        solver.setup(p_matrix, q.copy(), a_matrix, lower.copy(), upper.copy(), **settings)
        # The wrapper copies twenty fields of information per solve: 30 % more time per step. The extension object is
        # private; where a release of OSQP has none, the public interface is used.
        self._inner: Any = getattr(solver, "_solver", None) if self.settings.direct else None
        return solver

    def _solve(self, values: ProgramValues, initial: np.ndarray | None) -> Solution | None:
        p, q, a, lower, upper = values
        if self.workspace is None:
            self.workspace = self._setup(values)
            if self.start is not None:
                self.warm_start(*self.start[:2])
                self.start = None
        elif self._inner is not None:
            if self._inner.update_data_vec(q, lower, upper) or self._inner.update_data_mat(p, None, a, None):
                return None
        else:
            self.workspace.update(q=q, l=lower, u=upper, Px=p, Ax=a)
        if initial is not None:
            self.warm_start(initial, self._no_multipliers)  # after the update: OSQP computes A x here
        if self._inner is None:
            with _one_at_a_time.lock:
                result = self.workspace.solve(raise_error=False)
            x, y, info = result.x, result.y, result.info
        else:
            with _one_at_a_time.lock:
                self._inner.solve()
            solution, info = self._inner.solution, self._inner.info
            x, y = np.array(solution.x), np.array(solution.y)
        if info.status_val == INTERRUPTED:
            signal.raise_signal(signal.SIGINT)
        self._iterate = x, y
        return Solution(x, y, OUTCOMES.get(int(info.status_val)), int(info.iter))

    def warm_start(self, x: np.ndarray, y: np.ndarray) -> None:
        """Replace the iterate, unless the next solve sets up anew."""
        if self.workspace is None:
            return
        self._iterate = x, y = np.ascontiguousarray(x, float), np.ascontiguousarray(y, float)
        if self._inner is not None:
            self._inner.warm_start(x, y)
        else:
            self.workspace.warm_start(x=x, y=y)

    def save_memory(self) -> tuple[np.ndarray, np.ndarray, float] | None:
        """State of a flight: iterate and step size, from which the next solve sets up anew, here as in every copy."""
        if self.workspace is not None:
            self.start = *self._iterate, self.workspace.settings.rho
        return super().save_memory()


class _OneAtATime:
    """Lock of every solve in the process.

    OSQP puts its own handler of SIGINT in place meanwhile and restores the one before. After two overlapping solves
    that is its own, and Ctrl-C is dead.
    """

    def __init__(self) -> None:
        self.renew()
        if hasattr(os, "register_at_fork"):  # another thread may hold it while the process forks
            os.register_at_fork(after_in_child=self.renew)

    def renew(self) -> None:
        self.lock = threading.Lock()


_one_at_a_time = _OneAtATime()


def osqp_settings(settings: SolverSettings) -> dict[str, float]:
    """Settings under OSQP's own names."""
    return {
        "eps_abs": settings.tolerance,
        "eps_rel": settings.relative_tolerance,
        "max_iter": settings.max_iterations,
        "check_termination": settings.check_interval,
        "adaptive_rho_interval": settings.adaptive_rho_interval,
        "adaptive_rho_tolerance": settings.adaptive_rho_tolerance,
        "scaling": settings.scaling,
        "check_dualgap": False,  # costs of 1e5 make it a test of rounding; the residuals bound the thrust error
    }


SOLVER = OsqpSolver
