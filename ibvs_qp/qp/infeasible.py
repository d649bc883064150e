"""Which hard rows contradict each other: a smallest set of them that no thrusts satisfy together."""

from __future__ import annotations

import numpy as np

from ibvs_qp.qp.evaluator import ProgramData
from ibvs_qp.qp.problem import QpProblem

#: Residual of the certificate below which there is no solution; one r long lies 1/r newtons away, so none this side
#: of 10^8 N counts as none.
NO_CERTIFICATE = 1e-8


def conflicting_rows(problem: QpProblem, data: ProgramData) -> tuple[str, ...]:
    r"""Names of hard rows without a common solution, none of which could be spared; () where there is a solution.

    By Farkas' lemma :math:`G x \le h` has no solution exactly if some :math:`y \ge 0` has :math:`G^T y = 0` and
    :math:`h^T y = -1`. Non-negative least squares finds it, or leaves a residual of length
    :math:`1 / \sqrt{1 + d^2}`, d being the distance to the nearest solution. Its y has few non-zeros; of these rows
    every one that can be spared is struck off.

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
    # Bounds as seen from the middle of the thrusts' box: numbers of a few newtons, whatever the rows' units.
    at = rows @ (0.5 * (lower[:rotors] + upper[:rotors]))
    table = np.column_stack((rows / scale[:, None], (lower - at) / scale, (upper - at) / scale))
    kept = _certificate(table, list(range(len(hard))))
    for row in list(kept):
        kept = _certificate(table, [other for other in kept if other != row]) or kept
    return tuple(problem.row_names[hard[row]] for row in kept)


def _certificate(table: np.ndarray, chosen: list[int]) -> list[int]:
    """Rows of a proof that the chosen rows (coefficients, lower, upper) have no solution; none if they have one."""
    if not chosen:  # nothing contradicts nothing; and scipy 1.17 crashes on an empty matrix
        return []
    from scipy.optimize import nnls  # heavy, and only a program without a solution needs it

    rows, lower, upper = table[chosen, :-2], table[chosen, -2], table[chosen, -1]
    sides = np.vstack((np.hstack((rows.T, -rows.T)), np.concatenate((upper, -lower))))
    wanted = np.zeros(len(sides))
    wanted[-1] = -1.0
    try:
        weights, residual = nnls(sides, wanted)
    except RuntimeError:  # no end within its iterations
        return []
    if not residual < NO_CERTIFICATE:
        return []
    count = len(chosen)
    taken = weights[:count] + weights[count:] > 0.0
    return [row for row, used in zip(chosen, taken, strict=True) if used]
