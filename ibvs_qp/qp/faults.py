"""Causes of a program without a solution: inputs, tasks and limits with invalid numbers."""

from __future__ import annotations

import numpy as np

from ibvs_qp.qp.evaluator import ProgramData
from ibvs_qp.qp.problem import QpProblem


def program_faults(problem: QpProblem, data: ProgramData) -> tuple[str, ...]:
    """One sentence per invalid input, or else per invalid row; evaluated only if every solver failed.

    An input that is not finite breaks every row that uses it, so rows are checked only if all inputs are finite.
    """
    broken = [_broken(name, values) for name, values in data.inputs.items() if not np.isfinite(values).all()]
    return tuple(broken) or (*_task_faults(problem, data), *_limit_faults(problem, data))


def _broken(name: str, values: np.ndarray) -> str:
    entries = ", ".join(f"{value:g}" for value in values.tolist())
    return f"input {name}: ({entries}) is not finite"


def _task_faults(problem: QpProblem, data: ProgramData) -> list[str]:
    """Rows whose value, target or weight is no number, and weights below zero."""
    thrusts = np.ones(problem.model.rotors)  # not zero, so that a factor that is no number shows in any case
    achieved, asked, weights = data.report(data.point, thrusts)
    found = []
    for row, value, target, weight in zip(problem.task_rows, achieved, asked, weights, strict=True):
        if not np.isfinite((value, target, weight)).all():
            found.append(f"task {row.name}: value {value:g}, target {target:g} or weight {weight:g} is not finite")
        elif weight < 0.0:
            found.append(f"task {row.name}: its weight {weight:g} is below zero")
    return found


def _limit_faults(problem: QpProblem, data: ProgramData) -> list[str]:
    """Rows that hold a number that is none, and rows whose bounds leave no room between them."""
    found = []
    for i, row in enumerate(problem.limit_rows):
        crossed = data.lower[i] - data.upper[i]
        if not np.isfinite((*data.rows()[i], data.lower[i], data.upper[i])).all():
            found.append(f"limit {row.name}: its row or one of its bounds is not finite")
        elif crossed > 0.0:
            found.append(f"limit {row.name}: its lower bound is {crossed:.3g} {row.unit} above its upper one")
    return found
