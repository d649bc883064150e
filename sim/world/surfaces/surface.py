"""The shape of a wall: its chart, which maps places on it to the world and back.

A chart has the coordinates (depth, y, z): y and z are lengths along the surface, right and down from the board's bottom
left corner at y = 0, z = -bottom_m; depth is the distance behind the face. The world's x axis is the normal into the
wall in the middle of the board. On a plane chart and world are the same.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar, Protocol

import numpy as np

from ibvs_qp.frames import rotation_from_quaternion
from ibvs_qp.quaternion import conjugate, multiply

#: Steps of Newton's method along rays, and the step of its slope [m]: exact to 1e-9 m at a radius of 1.5 m.
HIT_STEPS, STEP_M = 5, 1e-5
#: Sides of a curved wall: it bends away from the vehicle, or towards it.
SIDES = CONVEX, CONCAVE = "convex", "concave"
#: Kinds of surfaces by name.
KINDS: dict[str, type[Surface]] = {}


class Shape(Protocol):
    """Settings of a surface, as the scene's section ``surface`` has them."""

    @property
    def radius_m(self) -> float:
        """Radius [m]."""
        ...

    @property
    def axis(self) -> str:
        """Direction of the axis: vertical or horizontal."""
        ...

    @property
    def side(self) -> str:
        """Side towards the vehicle, one of `SIDES`."""
        ...


class Surface(ABC):
    """A smooth surface; a subclass registers itself by ``class Own(Surface, kind="own")`` in a module of this folder.

    Args:
        middle: Middle of the board in the chart (y, z) [m], (2,).
        settings: The scene's section ``surface``.
    """

    #: Whether chart and world are the same.
    flat: ClassVar[bool] = False

    def __init__(self, middle: np.ndarray, settings: Shape) -> None:  # noqa: B027
        """Nothing by default."""

    def __init_subclass__(cls, kind: str) -> None:
        super().__init_subclass__()
        KINDS[kind] = cls

    @abstractmethod
    def chart(self, points: np.ndarray) -> np.ndarray:
        """Chart coordinates of points in the world [m], (..., 3)."""

    @abstractmethod
    def points(self, chart: np.ndarray) -> np.ndarray:
        """Points in the world of chart coordinates [m], (..., 3)."""

    @abstractmethod
    def attitude(self, place: np.ndarray) -> np.ndarray:
        """Quaternion (w, x, y, z) in the world of the tangent axes (into the wall, right, down) at a place (3,)."""

    @abstractmethod
    def curvature(self, place: np.ndarray) -> np.ndarray:
        """Normal curvatures along right and down at a place (3,) [1/m], (2,): > 0 bulges towards the vehicle."""

    def curvature_tensor(self, place: np.ndarray) -> np.ndarray:
        """The same as entries (right right, right down, down down), (3,)."""
        right, down = self.curvature(place)
        return np.array((right, 0.0, down))

    def axes(self, place: np.ndarray) -> np.ndarray:
        """Columns (into the wall, right, down) at a place of the chart (3,), in the world, (3, 3)."""
        return rotation_from_quaternion(self.attitude(place))

    def hit(self, origin: np.ndarray, directions: np.ndarray, place: np.ndarray, depth: float = 0.0) -> np.ndarray:
        """Ways along rays to the surface or to a depth behind it, by Newton's method.

        Args:
            origin: Common origin of the rays, in the world [m], (3,).
            directions: (..., 3).
            place: Place of the chart whose tangent plane is near the rays' ends, (3,).
            depth: Depth of the ends [m].

        Returns:
            Multiples of the directions, (...).
        """
        normal = self.axes(place)[:, 0]
        ways = (normal @ (self.points(place) - origin) + depth) / (directions @ normal)
        for _ in range(HIT_STEPS):
            ends = origin + ways[..., None] * directions
            before = self.chart(ends)[..., 0]
            slope = (self.chart(ends + STEP_M * directions)[..., 0] - before) / STEP_M
            ways = ways - (before - depth) / slope
        return ways

    def flattened(
        self, position: np.ndarray, quaternion: np.ndarray, place: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """A pose as seen from the tangent plane at a place: as before a flat wall with the same chart.

        Args:
            position: In the world [m], (3,).
            quaternion: Attitude in the world, (4,).
            place: Touching point of the tangent plane, in the chart (0, y, z) [m], (3,).

        Returns:
            Position [m], (3,), and quaternion, (4,).
        """
        if self.flat:
            return position, quaternion
        tangent = self.attitude(place)
        moved = rotation_from_quaternion(tangent).T @ (position - self.points(place))
        return moved + place, np.array(multiply(conjugate(tangent.tolist()), quaternion.tolist()))
