"""How the least cost of a program follows a bound of an active limit, for as long as the same limits are active."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, kw_only=True)
class BoundRange:
    """Range of one bound over which the set of active limits stays the same; there the cost is a parabola of the bound.

    Attributes:
        lower: Most negative change of the bound within it, in the row's unit; -inf where nothing ends it.
        upper: Most positive change.
        end: Row that ends it on the side to which the bound yields: it is released there, or becomes active.
        fall: By how much the cost is lower at that end, without unit.
    """

    lower: float
    upper: float
    end: int
    fall: float


def bound_ranges(
    hessian: np.ndarray, rows: np.ndarray, lower: np.ndarray, upper: np.ndarray, x: np.ndarray, y: np.ndarray
) -> dict[int, BoundRange]:
    r"""Ranges of the bounds of all active rows, by row.

    With the active rows :math:`A_W x = b_W`, solution and multipliers are linear in the bounds,

    .. math:: \begin{pmatrix} P & A_W^T \\ A_W & 0 \end{pmatrix} \begin{pmatrix} dx \\ dy_W \end{pmatrix} =
        \begin{pmatrix} 0 \\ db_W \end{pmatrix},

    until a multiplier is zero or another row meets its bound. The derivative of the cost by a bound is :math:`-y`.

    Args:
        hessian: P, positive definite, (variables, variables).
        rows: A, (rows, variables).
        lower: Bounds of A x, (rows,).
        upper: The same.
        x: Solution, (variables,).
        y: Its multipliers, > 0 at an upper bound, exactly 0 of an inactive row, (rows,).

    Returns:
        One range per active row; none if the active rows depend on each other.

    Source: Best, An algorithm for the solution of the parametric quadratic programming problem, 1996.
    """
    active, size = np.flatnonzero(y), len(x)
    matrix = np.zeros((size + len(active), size + len(active)))
    matrix[:size, :size], matrix[:size, size:], matrix[size:, :size] = hessian, rows[active].T, rows[active]
    try:
        moves = np.linalg.solve(matrix, np.eye(len(matrix))[:, size:])
    except np.linalg.LinAlgError:
        return {}
    value, free, found = rows @ x, np.flatnonzero(y == 0.0), {}
    for place, row in enumerate(active):
        slopes = rows @ moves[:size, place]  # of all values per unit of this bound
        changes = np.zeros(len(y))
        changes[active] = moves[size:, place]  # of all multipliers
        ends = {}
        for way in (-1.0, 1.0):
            room = np.full(len(y), math.inf)
            falling = np.flatnonzero(way * changes * y < 0.0)
            room[falling] = -y[falling] / (way * changes[falling])
            rising, sinking = free[way * slopes[free] > 0.0], free[way * slopes[free] < 0.0]
            room[rising] = (upper - value)[rising] / (way * slopes[rising])
            room[sinking] = (lower - value)[sinking] / (way * slopes[sinking])
            if way * y[row] < 0.0:  # it meets the row's other bound
                room[row] = upper[row] - lower[row]
            end = int(np.argmin(room))
            ends[way] = max(float(room[end]), 0.0), end
        length, end = ends[math.copysign(1.0, y[row])]
        fall = (abs(y[row]) + 0.5 * changes[row] * length) * length  # the multiplier falls by `changes` on the way
        found[int(row)] = BoundRange(lower=-ends[-1.0][0], upper=ends[1.0][0], end=end, fall=float(fall))
    return found
