"""A flat wall."""

from __future__ import annotations

import numpy as np

from sim.world.surfaces.surface import Surface


class Plane(Surface, kind="plane"):
    """The plane x = 0."""

    flat = True

    def chart(self, points: np.ndarray) -> np.ndarray:
        """The points themselves."""
        return points

    def points(self, chart: np.ndarray) -> np.ndarray:
        """The coordinates themselves."""
        return chart

    def attitude(self, place: np.ndarray) -> np.ndarray:
        """Axes of the world."""
        return np.array((1.0, 0.0, 0.0, 0.0))

    def curvature(self, place: np.ndarray) -> np.ndarray:
        """None."""
        return np.zeros(2)
