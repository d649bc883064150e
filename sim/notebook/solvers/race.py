"""Contenders on the same ticks: time, distance to the exact thrusts, ticks without an answer."""

from __future__ import annotations

import gc
import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ibvs_qp.qp.evaluator import ProgramData
from ibvs_qp.qp.exact import ExactSolver
from sim.notebook.solvers.contenders import Contender
from sim.notebook.solvers.programs import Stretch

#: Ticks that warm a contender up before it is measured.
WARM_UP = 20
#: Errors below this are rounding and drawn as this [N].
ROUNDING_N = 1e-14


@dataclass(frozen=True, kw_only=True)
class Exact:
    """The yardstick.

    Attributes:
        x: Solutions, (N, variables).
        residual: Largest violation of the optimality conditions at every tick, relative to the gradient, (N,).
    """

    x: np.ndarray
    residual: np.ndarray


@dataclass(frozen=True, kw_only=True)
class Result:
    """How one contender did.

    Attributes:
        contender: Who.
        times_us: Time of the measuring thread per tick [us], (N,).
        errors_n: Largest distance of a thrust to the exact one [N], (N,); NaN without an answer.
        iterations: Of the solver, (N,); 0 where it does not say.
    """

    contender: Contender
    times_us: np.ndarray
    errors_n: np.ndarray
    iterations: np.ndarray

    @property
    def unanswered(self) -> int:
        """Ticks without an answer."""
        return int(np.isnan(self.errors_n).sum())


def exact_solutions(stretch: Stretch) -> Exact:
    """Solutions by DAQP, and the residual of the optimality conditions as proof.

    Raises:
        RuntimeError: When a tick has no solution, which the programs of this controller always have.
    """
    solver, rows, residuals = ExactSolver(stretch.template), [], []
    for data in stretch.evaluators():
        found = solver.solve(data.p, data.q, data.a, data.lower, data.upper)
        if found is None:
            raise RuntimeError("a recorded tick has no solution")
        rows.append(found[0])
        residuals.append(optimality_residual(data, *found))
    return Exact(x=np.array(rows), residual=np.array(residuals))


def optimality_residual(data: ProgramData, x: np.ndarray, y: np.ndarray) -> float:
    r"""Largest violation of stationarity, bounds and signs, each over its own scale [-].

    .. math:: P x + q + A^T y = 0, \quad l \le A x \le u, \quad y_+ (u - A x) = 0, \; y_- (A x - l) = 0
    """
    gradient, at = data.hessian() @ x + data.q, data.rows() @ x
    scale = np.abs(data.q).max()
    stationary = float(np.abs(gradient + data.rows().T @ y).max() / scale)
    outside = float(np.maximum(data.lower - at, at - data.upper).max() / np.abs(at).max())
    slack = np.where(y > 0.0, y * (data.upper - at), -y * (at - data.lower))
    return max(stationary, outside, float(np.abs(slack).max() / scale))


def race(contender: Contender, stretch: Stretch, exact: Exact, repeats: int = 1) -> Result:
    """Let one contender answer every tick in order.

    Args:
        contender: Who.
        stretch: The ticks.
        exact: Their solutions.
        repeats: Rounds through the whole stretch; the fastest time of a tick counts, its first answer is judged.
    """
    rotors, times, errors, iterations = stretch.template.model.rotors, [], [], []
    answer = contender.make(stretch.template)
    for data in stretch.part(0, WARM_UP).evaluators():
        answer(data)
    for _ in range(repeats):
        spent = []
        gc.disable()  # a collection in the middle of a tick would be charged to it
        for index, data in enumerate(stretch.evaluators()):
            start = time.thread_time_ns()
            x, count = answer(data)
            spent.append(1e-3 * (time.thread_time_ns() - start))
            if len(errors) < len(stretch.stacked):
                errors.append(np.nan if x is None else np.abs(x[:rotors] - exact.x[index, :rotors]).max())
                iterations.append(count)
        gc.enable()
        times.append(spent)
    return Result(
        contender=contender,
        times_us=np.min(times, axis=0),
        errors_n=np.maximum(np.array(errors), ROUNDING_N),
        iterations=np.array(iterations),
    )


def race_all(contenders: Sequence[Contender], stretch: Stretch, exact: Exact, repeats: int = 1) -> list[Result]:
    """All of them, one after the other."""
    return [race(contender, stretch, exact, repeats) for contender in contenders]
