"""Interaction matrix of the image of a line on a plane: the one source for vision, tasks, limits and both laws."""

from __future__ import annotations

import math
from typing import Any

import casadi as ca
import numpy as np

Plane = tuple[float, float, float, float]


def line_interaction_matrix(rho: float, theta: float, plane: Plane | np.ndarray) -> np.ndarray:
    r"""Interaction matrix L of a line on a plane: :math:`(\dot\rho, \dot\theta) = L\,[v; \omega]_C`.

    With :math:`l_t = (A \sin\theta - B \cos\theta)/D`, :math:`l_r = (A\rho\cos\theta + B\rho\sin\theta + C)/D`:

    .. math::
        L_\rho = [l_r c, l_r s, -l_r \rho, (1+\rho^2) s, -(1+\rho^2) c, 0], \quad
        L_\theta = [l_t c, l_t s, -l_t \rho, -\rho c, -\rho s, -1].

    Args:
        rho: Distance of the line from the image centre in normalised coordinates, any sign.
        theta: Angle of the line's normal [rad].
        plane: (A, B, C, D) with A X + B Y + C Z + D = 0 in the camera frame, at any scale and sign.

    Returns:
        Matrix of shape (2, 6): row rho, row theta; columns camera velocity [m/s] and angular velocity [rad/s] in C.

    Raises:
        ValueError: When D is zero: the camera centre lies in the plane.

    Source: Espiau, Chaumette, Rives, "A new approach to visual servoing in robotics", 1992, section II.
    """
    a, b, c, d = (float(entry) for entry in plane)
    if d == 0.0:
        raise ValueError("plane: D = 0, the camera centre lies in the plane and the line has no interaction matrix")
    return np.array(_rows(rho, math.cos(theta), math.sin(theta), a / d, b / d, c / d), float)


def symbolic_line_rows(rho: ca.SX, theta: ca.SX, plane: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Rows rho and theta of the same matrix as symbols, (1, 6) each, for a plane (A, B, C) with D = -1."""
    a, b, c = ca.vertsplit(plane)
    row_rho, row_theta = _rows(rho, ca.cos(theta), ca.sin(theta), -a, -b, -c)
    return ca.horzcat(*row_rho), ca.horzcat(*row_theta)


def _rows(rho: Any, cos: Any, sin: Any, a: Any, b: Any, c: Any) -> list[list[Any]]:
    """Both rows for a plane divided by D, of numbers or of symbols."""
    l_theta = a * sin - b * cos
    l_rho = a * rho * cos + b * rho * sin + c
    square = 1.0 + rho * rho
    return [
        [l_rho * cos, l_rho * sin, -l_rho * rho, square * sin, -square * cos, 0.0],
        [l_theta * cos, l_theta * sin, -l_theta * rho, -rho * cos, -rho * sin, -1.0],
    ]


def endpoint_line_row(rows: Any, theta: Any, tip_point: tuple[Any, Any]) -> Any:
    r"""Row of the line's distance from an image point: :math:`L_\rho + (x_t \sin\theta - y_t \cos\theta) L_\theta`.

    It is the rate of :math:`e = \rho - (x_t \cos\theta + y_t \sin\theta)` for an image point that stays where it is.

    Args:
        rows: Rows rho and theta of the interaction matrix, numbers (2, 6) or symbols.
        theta: Angle of the line's normal [rad].
        tip_point: Image of the tip in normalised coordinates.

    Returns:
        Row of six entries.
    """
    x_tip, y_tip = tip_point
    cos, sin = (ca.cos(theta), ca.sin(theta)) if isinstance(theta, ca.SX) else (math.cos(theta), math.sin(theta))
    return rows[0] + (x_tip * sin - y_tip * cos) * rows[1]
