"""OSQP with one persistent workspace: values updated in place, warm started, every trap guarded."""

from __future__ import annotations

import math
import signal
import time
from dataclasses import dataclass
from operator import gt

import numpy as np
import osqp

from ibvs_qp.config import SolverSettings
from ibvs_qp.qp.problem import ProgramPatterns

#: Status values of OSQP 1.x whose iterate means something.
SOLVED, SOLVED_INACCURATE, MAX_ITERATIONS = 1, 2, 7
#: Status of a solve that Ctrl-C ended: OSQP replaces the signal's handler meanwhile.
INTERRUPTED = 10


@dataclass(slots=True)
class RawSolution:
    """Answer of OSQP before the acceptance test: x, y, status value, iterations, wall-clock time [s]."""

    x: np.ndarray
    y: np.ndarray
    status: int
    iterations: int
    seconds: float


class OsqpSolver:
    """OSQP with one workspace for all ticks.

    Guards, each against a behaviour reproduced on OSQP 1.1: non-finite data is refused, because one NaN stays in the
    warm start; l > u is refused, because such an update is dropped silently; strided arrays are copied and wrong
    lengths refused, because neither is checked; set-up receives private copies, because updates write into its
    matrices; a reset sets up anew, because the adapted rho survives; Ctrl-C during a solve is raised again, because
    OSQP swallows it. The limits keep l and u at least 1e-4 apart; any closer, OSQP would turn the row into an equality
    and factorise again.
    """

    def __init__(self, problem: ProgramPatterns, settings: SolverSettings) -> None:
        self._problem, self._settings = problem, settings
        rows, variables = problem.a_pattern.toarray().shape
        self._lengths = (problem.p_pattern.nnz, variables, problem.a_pattern.nnz, rows, rows)
        self._no_multipliers = np.zeros(rows)
        self._iterate = np.zeros(variables), self._no_multipliers
        self.reset()

    def reset(self) -> None:
        """Drop the iterate and the adapted step size: the next solve is as after construction."""
        self._reset_pending = True
        self._start: tuple[np.ndarray, np.ndarray, float] | None = None  # x, y and step size of the next set-up

    def save_memory(self) -> tuple[np.ndarray, np.ndarray, float] | None:
        """State of a flight: iterate and step size, from which the next solve sets up anew, here as in every copy.

        OSQP's workspace cannot be copied; a set-up from these differs from it by rounding.
        """
        if not self._reset_pending:
            x, y = self._iterate
            self._start, self._reset_pending = (x, y, self._solver.settings.rho), True
        return self._start

    def load_memory(self, start: tuple[np.ndarray, np.ndarray, float] | None) -> None:
        """Continue from a state."""
        self._start, self._reset_pending = start, True

    def _setup(self, p: np.ndarray, q: np.ndarray, a: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> None:
        settings, problem = self._settings, self._problem
        p_matrix, a_matrix = problem.p_pattern.copy(), problem.a_pattern.copy()
        p_matrix.data, a_matrix.data = p.copy(), a.copy()
        self._solver = osqp.OSQP()
        self._solver.setup(
            p_matrix,
            q.copy(),
            a_matrix,
            lower.copy(),
            upper.copy(),
            verbose=False,
            eps_abs=settings.tolerance,
            eps_rel=settings.relative_tolerance,
            max_iter=settings.max_iterations,
            check_termination=settings.check_interval,
            adaptive_rho_interval=settings.adaptive_rho_interval,
            adaptive_rho_tolerance=settings.adaptive_rho_tolerance,
            scaling=settings.scaling,
            check_dualgap=False,  # costs of 1e5 make it a test of rounding; the residuals bound the thrust error
            warm_starting=True,
            **({} if self._start is None else {"rho": self._start[2]}),
        )
        self._reset_pending = False
        # The wrapper copies twenty fields of information per solve: 30 % more time per step. The extension object is
        # private; where a release of OSQP has none, the public interface is used.
        self._inner = getattr(self._solver, "_solver", None) if settings.direct else None
        if self._start is not None:
            self.warm_start(*self._start[:2])
            self._start = None

    def solve(
        self,
        p: np.ndarray,
        q: np.ndarray,
        a: np.ndarray,
        lower: np.ndarray,
        upper: np.ndarray,
        initial: np.ndarray | None = None,
    ) -> RawSolution | None:
        """Solve with new values; None when the data is not finite or a bound pair is crossed.

        Args:
            p: Non-zeros of the upper triangle of P.
            q: Gradient.
            a: Non-zeros of A.
            lower: Lower bounds of the rows.
            upper: Upper bounds of the rows.
            initial: Iterate to start from, with multipliers of zero; None for the last solution.

        Raises:
            ValueError: When an array has another length than the program.
        """
        start = time.perf_counter()
        p, q, a, lower, upper = arrays = [np.ascontiguousarray(array, float) for array in (p, q, a, lower, upper)]
        if tuple(map(len, arrays)) != self._lengths:
            raise ValueError(f"P, q, A, l, u need {self._lengths} entries, not {tuple(map(len, arrays))}")
        squares = p.dot(p) + q.dot(q) + a.dot(a) + lower.dot(lower) + upper.dot(upper)  # not finite if one entry is not
        if not math.isfinite(squares) or any(map(gt, lower.tolist(), upper.tolist())):
            return None
        if self._reset_pending:
            self._setup(p, q, a, lower, upper)
        elif self._inner is not None:
            if self._inner.update_data_vec(q, lower, upper) or self._inner.update_data_mat(p, None, a, None):
                return None
        else:
            self._solver.update(q=q, l=lower, u=upper, Px=p, Ax=a)
        if initial is not None and math.isfinite(initial.dot(initial)):
            self.warm_start(initial, self._no_multipliers)  # after the update: OSQP computes A x here
        if self._inner is None:
            result = self._solver.solve(raise_error=False)
            x, y, info = result.x, result.y, result.info
        else:
            self._inner.solve()
            solution, info = self._inner.solution, self._inner.info
            x, y = np.array(solution.x), np.array(solution.y)
        if info.status_val == INTERRUPTED:
            signal.raise_signal(signal.SIGINT)
        self._iterate = x, y
        return RawSolution(x, y, int(info.status_val), int(info.iter), time.perf_counter() - start)

    def warm_start(self, x: np.ndarray, y: np.ndarray) -> None:
        """Replace the iterate, unless the next solve sets up anew."""
        if self._reset_pending:
            return
        self._iterate = x, y = np.ascontiguousarray(x, float), np.ascontiguousarray(y, float)
        if self._inner is not None:
            self._inner.warm_start(x, y)
        else:
            self._solver.warm_start(x=x, y=y)
