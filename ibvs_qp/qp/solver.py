r"""A solver of one program of fixed sparsity, and the acceptance test of its solutions.

.. math:: \min \tfrac12 x^T P x + q^T x \quad\text{s.t.}\quad l \le A x \le u
"""

from __future__ import annotations

import importlib
import math
import time
from abc import ABC, abstractmethod
from dataclasses import dataclass
from operator import gt
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, Protocol

import numpy as np

from ibvs_qp.command import Outcome
from ibvs_qp.config import SolverSettings
from ibvs_qp.config.errors import ConfigError

if TYPE_CHECKING:
    from scipy import sparse

#: A row whose multiplier exceeds this is active [cost per unit of the row]. OSQP projects on the bounds, so a free row
#: has a multiplier of 1e-12 at most; where a row is just touched, its multiplier is uncertain by about `tolerance`
#: times the coupling between rows, 1e-4.
ACTIVE_MULTIPLIER = 1e-3
#: Largest violation of a hard row in a solved program [N of thrust]; thrusts are clipped to their bounds.
BOUND_SLIP = 1e-2
#: Largest violation of a row by a solution refined on the active set [N of thrust].
REFINED_SLIP = 1e-5


#: Curvature of the cost in its softest direction [1/N^2]: `weights.effort`.
SOFTEST = 1e-3


class ProgramPatterns(Protocol):
    """Sparsity of a program: upper triangle of P, and A; enough for a solver."""

    p_pattern: sparse.csc_matrix
    a_pattern: sparse.csc_matrix


class DenseProgram:
    """P and A in full, from their non-zeros in the order of the patterns."""

    def __init__(self, patterns: ProgramPatterns) -> None:
        p, a = patterns.p_pattern.tocoo(), patterns.a_pattern.tocoo()
        self._p, self._a, self._rows, self._variables = (p.row, p.col), (a.row, a.col), *a.toarray().shape

    def hessian(self, p: np.ndarray) -> np.ndarray:
        """P, (variables, variables)."""
        full = np.zeros((self._variables, self._variables))
        full[self._p] = full[self._p[::-1]] = p
        return full

    def rows(self, a: np.ndarray) -> np.ndarray:
        """A, (rows, variables)."""
        full = np.zeros((self._rows, self._variables))
        full[self._a] = a
        return full


class ProgramValues(NamedTuple):
    """Non-zeros of the upper triangle of P and of A in the order of their patterns, and q, l, u."""

    p: np.ndarray
    q: np.ndarray
    a: np.ndarray
    lower: np.ndarray
    upper: np.ndarray


class Tried(NamedTuple):
    """A solver's iterations and wall-clock time [s] on a program, whether or not its answer was accepted."""

    iterations: int
    seconds: float


class Solution(NamedTuple):
    """Answer of a solver before the acceptance test.

    Attributes:
        x: Variables, (variables,).
        y: Multipliers of the rows, > 0 at an upper bound, (rows,).
        status: Outcome if the residuals confirm it: solved, stopped early, or None for an x without meaning.
        iterations: Of the solver; 0 where it does not report them.
        seconds: Wall-clock time [s].
    """

    x: np.ndarray
    y: np.ndarray
    status: Outcome | None
    iterations: int
    seconds: float = 0.0


@dataclass(slots=True)
class AcceptedSolution:
    """Thrusts within their bounds (n,), primal x, multipliers y, how they were found, and whether a row is active."""

    thrusts: np.ndarray
    x: np.ndarray
    y: np.ndarray
    outcome: Outcome
    iterations: int
    seconds: float
    limited: bool


class Solver(ABC):
    """A solver of one program, warm between its ticks where the library has workspaces.

    A further solver is one file in ``ibvs_qp/qp/solvers``: its class as ``SOLVER``. The file's name is then a value of
    `solver.name`. Data that is not finite and crossed bounds never reach the library.

    Attributes:
        tests_residuals: Whether a solved program has residuals within `solver.tolerance` and multipliers of no row away
            from its bounds, by the library's own test.
        dense: P and A in full, for libraries that take dense matrices.
        workspace: Of the library; None until the first solve after a reset.
        start: Start of the next set-up, such as the iterate x, y; None for a cold start.

    Args:
        patterns: Sparsity of the program.
        settings: Tolerance and iterations; each solver uses those of its library.
    """

    tests_residuals: ClassVar[bool] = False

    def __init__(self, patterns: ProgramPatterns, settings: SolverSettings) -> None:
        self.patterns, self.settings = patterns, settings
        self.dense = DenseProgram(patterns)
        rows, variables = patterns.a_pattern.toarray().shape
        self._lengths = (patterns.p_pattern.nnz, variables, patterns.a_pattern.nnz, rows, rows)
        self.workspace: Any = None
        self.start: Any = None

    def solve(
        self,
        p: np.ndarray,
        q: np.ndarray,
        a: np.ndarray,
        lower: np.ndarray,
        upper: np.ndarray,
        initial: np.ndarray | None = None,
    ) -> Solution | None:
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
        values = ProgramValues(*[np.ascontiguousarray(array, float) for array in (p, q, a, lower, upper)])
        if tuple(map(len, values)) != self._lengths:
            raise ValueError(f"P, q, A, l, u need {self._lengths} entries, not {tuple(map(len, values))}")
        p, q, a, lower, upper = values
        squares = p.dot(p) + q.dot(q) + a.dot(a) + lower.dot(lower) + upper.dot(upper)  # not finite if one entry is not
        if not math.isfinite(squares) or any(map(gt, lower.tolist(), upper.tolist())):
            return None
        if initial is not None and not math.isfinite(initial.dot(initial)):
            initial = None
        found = self._solve(values, initial)
        return None if found is None else found._replace(seconds=time.perf_counter() - start)

    @abstractmethod
    def _solve(self, values: ProgramValues, initial: np.ndarray | None) -> Solution | None:
        """Solve checked values; they stay the caller's. The first solve after `reset` sets up `workspace`."""

    def warm_start(self, x: np.ndarray, y: np.ndarray) -> None:
        """Replace the iterate of a solver that has one."""
        self.start = x, y

    def reset(self) -> None:
        """Drop the iterate and all adapted parameters: the next solve is as after construction."""
        self.workspace = self.start = None

    def save_memory(self) -> Any:
        """State of a flight, from which the next solve sets up anew, here as in every copy.

        Workspaces of libraries cannot be copied; a new set-up differs from the old one by rounding.
        """
        self.workspace = None
        return self.start

    def load_memory(self, start: Any) -> None:
        """Continue from a state."""
        self.workspace, self.start = None, start

    @property
    def gap_tolerance(self) -> float:
        """Duality gap at the same distance from the solution as a dual residual of `tolerance`, for interior points."""
        return self.settings.tolerance**2 / (2.0 * SOFTEST)


def make_solver(patterns: ProgramPatterns, settings: SolverSettings) -> Solver:
    """The solver of the settings.

    Raises:
        ConfigError: When its library is not installed.
    """
    try:
        module = importlib.import_module(f"ibvs_qp.qp.solvers.{settings.name}")
    except ModuleNotFoundError as error:
        missing = f"the library {error.name} is not installed (pip install 'ibvs-qp[solvers]')"
        raise ConfigError(f"solver.name = {settings.name!r} is refused: {missing}") from None
    return module.SOLVER(patterns, settings)
