"""Reach by linear programs, independent of the facets: the oracle of several test modules."""

from __future__ import annotations

import math

import numpy as np
from scipy.optimize import linprog

WEIGHT, TIP = 6.0 * 9.81, np.array([0.70, 0.0, 0.0])
IDLE, FULL = 1.2, 52.56
LOWER, UPPER = np.full(6, IDLE), np.full(6, FULL)
RIGHT, DOWN = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])


def by_linear_program(
    matrix: np.ndarray, start: np.ndarray, direction: np.ndarray, lower: np.ndarray, upper: np.ndarray, sign: float
) -> float:
    """Greatest (sign 1) or least (sign -1) t >= 0 with start + t direction attainable; NaN when there is none."""
    count = matrix.shape[1]
    result = linprog(
        np.append(np.zeros(count), -sign),
        A_eq=np.column_stack((matrix, -direction)),
        b_eq=start,
        bounds=[*zip(lower, upper, strict=True), (0.0, None)],
        method="highs",
    )
    return float(result.x[-1]) if result.status == 0 else math.nan
