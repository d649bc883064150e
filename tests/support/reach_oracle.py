"""Rotor layouts, and reach by linear programs, independent of the facets: the oracle of several test modules."""

from __future__ import annotations

import math

import numpy as np
from scipy.optimize import linprog

from allocation import Rotor, RotorGeometry

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


#: A flat octorotor with 13 inch propellers and alternating 30 degree tilt: fully actuated, two redundant rotors.
OCTOROTOR = RotorGeometry(
    rotors=tuple(
        Rotor(name=f"rotor_{index}", azimuth_deg=22.5 + 45.0 * index, spin=1 if index % 2 == 0 else -1)
        for index in range(8)
    ),
    circle_radius_m=0.46,
    tilt_deg=30.0,
    torque_ratio_m=0.020,
)
