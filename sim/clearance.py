"""How near the propeller discs come to board and wall."""

from __future__ import annotations

import math

import numpy as np

from ibvs_qp.vehicle import VehicleParams
from sim.board import BoardGeometry

#: Points on the rim of every disc; between two of them the rim departs by radius * (1 - cos(7.5 deg)) = 1.6 mm.
RIM_POINTS = 24


class PropellerClearance:
    """Distance of the propeller discs to the board's face inside its outline and to the wall elsewhere.

    Args:
        board: Board and wall.
        vehicle: Rotors and propeller radius.
    """

    def __init__(self, board: BoardGeometry, vehicle: VehicleParams) -> None:
        geometry = vehicle.geometry
        self._board = board
        self._size = np.array([board.scene.board.width_m, board.scene.board.height_m])
        self._gap = board.scene.board.gap_m
        self._radius = vehicle.propeller_radius_m
        self._positions, self._axes = geometry.positions, geometry.axes
        self._rims = np.vstack([self._rim(p, t) for p, t in zip(self._positions, self._axes, strict=True)])

    def _rim(self, position: np.ndarray, axis: np.ndarray) -> np.ndarray:
        first = np.cross(axis, [1.0, 0.0, 0.0])
        first /= np.linalg.norm(first)
        angle = np.arange(RIM_POINTS)[:, None] * (2.0 * math.pi / RIM_POINTS)
        return position + self._radius * (np.cos(angle) * first + np.sin(angle) * np.cross(axis, first))

    def foremost(self, position: np.ndarray, rotation: np.ndarray) -> float:
        """Largest world x that any disc reaches [m], exact and quick; negative: clear of board and wall."""
        axis = self._axes @ rotation[0]
        reach = self._positions @ rotation[0] + self._radius * np.sqrt(np.maximum(1.0 - axis * axis, 0.0))
        return float(position[0] + reach.max())

    def distance(self, position: np.ndarray, rotation: np.ndarray) -> float:
        """Smallest distance of any disc to the surface straight ahead of it [m]; negative inside a surface.

        Args:
            position: Body origin, world NED [m], (3,).
            rotation: Rotation B to I, (3, 3).
        """
        rim = position + self._rims @ rotation.T
        on_board = self._board.board_coordinates(rim[:, 1:])
        inside = np.all((on_board >= 0.0) & (on_board <= self._size), axis=1)
        nearest = self._gap - self.foremost(position, rotation)
        if inside.any():
            nearest = min(nearest, float(-rim[inside, 0].max()))
        return nearest
