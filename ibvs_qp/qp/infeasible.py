"""Causes of a program without a solution: hard rows that contradict each other, and invalid numbers."""

from __future__ import annotations

import numpy as np

from ibvs_qp.qp.problem import ProgramData, QpProblem

#: Residual of the certificate below which there is no solution; a residual r means a solution
#: 1/r newtons away.
NO_CERTIFICATE = 1e-8


def conflicting_rows(problem: QpProblem, data: ProgramData) -> tuple[str, ...]:
    r"""Names of a smallest set of hard rows without a common solution; () if there is one.

    By Farkas' lemma :math:`G x \le h` has no solution exactly if some :math:`y \ge 0` has :math:`G^T y = 0` and
    :math:`h^T y = -1`. Non-negative least squares finds it, or leaves a residual of length
    :math:`1 / \sqrt{1 + d^2}`, d being the distance to the nearest solution. Its y has few non-zeros; every
    row that the contradiction does not need is removed.

    Args:
        problem: Names of the rows, and which of them are hard.
        data: Values of one tick's program.

    Source: Gleeson and Ryan, Identifying minimally infeasible subsystems of inequalities, ORSA J. Computing 1990;
        Chinneck, Feasibility and Infeasibility in Optimization, 2008, section 6.2 (deletion filter).
    """
    hard = np.flatnonzero(problem.row_slack < 0)
    rotors = problem.model.rotors
    rows, lower, upper = data.rows()[hard, :rotors], data.lower[hard], data.upper[hard]
    if not np.isfinite((rows.sum(), lower.sum(), upper.sum())).all():
        return ()
    scale = np.linalg.norm(rows, axis=1)
    scale[scale == 0.0] = 1.0
    # Bounds relative to the middle of the thrusts' box: numbers of a few newtons for rows of any unit.
    at = rows @ (0.5 * (lower[:rotors] + upper[:rotors]))
    table = np.column_stack((rows / scale[:, None], (lower - at) / scale, (upper - at) / scale))
    kept = _certificate(table, list(range(len(hard))))
    for row in list(kept):
        kept = _certificate(table, [other for other in kept if other != row]) or kept
    return tuple(problem.row_names[hard[row]] for row in kept)


def _certificate(table: np.ndarray, chosen: list[int]) -> list[int]:
    """Rows of a proof that the chosen rows (coefficients, lower, upper) have no solution; empty if they have one."""
    if not chosen:  # nothing contradicts nothing; and scipy 1.17 crashes on an empty matrix
        return []
    from scipy.optimize import nnls  # heavy, and only a program without a solution needs it

    rows, lower, upper = table[chosen, :-2], table[chosen, -2], table[chosen, -1]
    sides = np.vstack((np.hstack((rows.T, -rows.T)), np.concatenate((upper, -lower))))
    target = np.zeros(len(sides))
    target[-1] = -1.0
    try:
        weights, residual = nnls(sides, target)
    except RuntimeError:  # no end within its iterations
        return []
    if not residual < NO_CERTIFICATE:
        return []
    count = len(chosen)
    taken = weights[:count] + weights[count:] > 0.0
    return [row for row, used in zip(chosen, taken, strict=True) if used]


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
    """Rows whose value, target or weight is not finite, and weights below zero."""
    thrusts = np.ones(problem.model.rotors)  # not zero, so that every NaN factor shows
    achieved, asked, weights = problem.report(data.point, thrusts)
    found = []
    for row, value, target, weight in zip(problem.task_rows, achieved, asked, weights, strict=True):
        if not np.isfinite((value, target, weight)).all():
            found.append(f"task {row.name}: value {value:g}, target {target:g} or weight {weight:g} is not finite")
        elif weight < 0.0:
            found.append(f"task {row.name}: its weight {weight:g} is below zero")
    return found


def _limit_faults(problem: QpProblem, data: ProgramData) -> list[str]:
    """Rows with a number that is not finite, and rows whose bounds are crossed."""
    found = []
    for i, row in enumerate(problem.limit_rows):
        crossed = data.lower[i] - data.upper[i]
        if not np.isfinite((*data.rows()[i], data.lower[i], data.upper[i])).all():
            found.append(f"limit {row.name}: its row or one of its bounds is not finite")
        elif crossed > 0.0:
            found.append(f"limit {row.name}: its lower bound is {crossed:.3g} {row.unit} above its upper one")
    return found
