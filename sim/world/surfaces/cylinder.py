"""A round pier or tank, from outside or inside."""

from __future__ import annotations

import math

import numpy as np

from sim.world.surfaces.surface import CONCAVE, Shape, Surface


class Cylinder(Surface, kind="cylinder"):
    r"""A cylinder about a vertical or horizontal axis that touches the plane x = 0 in the middle of the board.

    With s the way around it from there, R the radius and :math:`\sigma = 1` where it bulges towards the vehicle (-1
    where it is concave), a place at depth d has, in the plane across the axis,

    .. math:: x = \sigma (R - \rho \cos(s / R)), \quad y = \rho \sin(s / R), \quad \rho = R - \sigma d
    """

    def __init__(self, middle: np.ndarray, settings: Shape) -> None:
        self._radius, self._sign = settings.radius_m, -1.0 if settings.side == CONCAVE else 1.0
        self._around = 1 if settings.axis == "vertical" else 2  # index of the coordinate that goes around the axis
        self._middle = float(middle[self._around - 1])

    def chart(self, points: np.ndarray) -> np.ndarray:
        """Depth and unrolled place."""
        chart = np.array(points, float)
        away = self._radius - self._sign * chart[..., 0]
        aside = chart[..., self._around] - self._middle
        chart[..., 0] = self._sign * (self._radius - np.hypot(away, aside))
        chart[..., self._around] = self._middle + self._radius * np.arctan2(aside, away)
        return chart

    def points(self, chart: np.ndarray) -> np.ndarray:
        """Places rolled onto the cylinder."""
        points = np.array(chart, float)
        angle = (points[..., self._around] - self._middle) / self._radius
        rho = self._radius - self._sign * points[..., 0]
        points[..., 0] = self._sign * (self._radius - rho * np.cos(angle))
        points[..., self._around] = self._middle + rho * np.sin(angle)
        return points

    def attitude(self, place: np.ndarray) -> np.ndarray:
        """Turned about the axis by the way around it."""
        half = 0.5 * self._sign * (float(place[self._around]) - self._middle) / self._radius
        if self._around == 1:  # to the right, the face of a bulge turns away to the right
            return np.array((math.cos(half), 0.0, 0.0, -math.sin(half)))
        return np.array((math.cos(half), 0.0, math.sin(half), 0.0))

    def curvature(self, place: np.ndarray) -> np.ndarray:
        """Around the axis alone."""
        curvature = np.zeros(2)
        curvature[self._around - 1] = self._sign / self._radius
        return curvature
