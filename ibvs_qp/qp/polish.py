"""From a nearly optimal point to the optimum: the program solved exactly on the rows that OSQP found active."""

from __future__ import annotations

import numpy as np

from ibvs_qp.qp.evaluator import ProgramData

#: A row may lie outside its bounds by this much, and a multiplier on the wrong side of zero, relative to the largest.
TOLERANCE = 1e-7
#: A guess of the active rows is mended this often before it is given up.
ROUNDS = 4


def polished(data: ProgramData, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    r"""Solution and multipliers that meet the optimality conditions to rounding, or None if the rows are not right.

    A row counts as active where its multiplier is larger than its distance to the bound (Stellato et al., OSQP,
    Mathematical Programming Computation 2020, section 5.2). With those rows as equalities

    .. math::
        x = x_0 - P^{-1} A_a^T y_a, \quad A_a P^{-1} A_a^T y_a = A_a x_0 - b_a, \quad x_0 = -P^{-1} q.

    A row that this violates joins, one that pulls the wrong way leaves, and when there is neither it is THE solution,
    whatever made the guess. OSQP 1.1 has a polishing step too, but prints a line for every tick.

    Args:
        data: The program.
        x: Nearly optimal point, (variables,).
        y: Its multipliers, > 0 at an upper bound, (rows,).
    """
    rows, lower, upper = data.rows(), data.lower, data.upper
    try:
        solved = np.linalg.solve(data.hessian(), np.column_stack((-data.q, rows.T)))
    except np.linalg.LinAlgError:
        return None
    free, per_row = solved[:, 0], solved[:, 1:]
    at_free, coupling, at = rows @ free, rows @ per_row, rows @ x
    high, low = upper - at < y, at - lower < -y
    for _ in range(ROUNDS):
        active = np.flatnonzero(high | low)
        bound = np.where(high, upper, lower)
        prices = np.zeros(len(y))
        try:
            prices[active] = np.linalg.solve(coupling[np.ix_(active, active)], (at_free - bound)[active])
        except np.linalg.LinAlgError:
            return None
        at = at_free - coupling @ prices
        slip = TOLERANCE * (1.0 + np.abs(at).max())
        pull = TOLERANCE * (1.0 + np.abs(prices).max())
        above, below = at > upper + slip, at < lower - slip
        wrong = (high & (prices < -pull)) | (low & (prices > pull))
        if not (above.any() or below.any() or wrong.any()):
            return free - per_row @ prices, prices
        high, low = (high | above) & ~wrong & ~below, (low | below) & ~wrong & ~above
    return None
