"""Distance of the propeller discs to board and wall."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from allocation.geometry import perpendicular
from ibvs_qp.config.vehicle import VehicleParams
from sim.world.board import BoardGeometry

#: Points on the rim of every disc, 17 mm apart: the resolution with which a disc crosses the board's outline; its
#: foremost point is exact.
RIM_POINTS = 72
#: Poses per block [-]: their rims fill less than a megabyte; blocks four times as large take 37 ms a flight instead of
#: 7, because every intermediate result is allocated anew by the operating system.
BLOCK = 64


class PropellerClearance:
    """Distance of the propeller discs to the board's face inside its outline and to the wall elsewhere.

    Attributes:
        reach: Largest distance of any disc point from the body's origin [m].

    Args:
        board: Board and wall.
        vehicle: Rotors and propeller radius.
    """

    def __init__(self, board: BoardGeometry, vehicle: VehicleParams) -> None:
        geometry = vehicle.geometry
        self._size = np.array([board.scene.board.width_m, board.scene.board.height_m])
        self._gap, self._surface = board.scene.board.gap_m, board.surface
        self._radius = vehicle.propeller_radius_m
        self._positions, self._axes = geometry.positions, geometry.axes
        self._rims = np.stack([self._rim(p, t) for p, t in zip(self._positions, self._axes, strict=True)])
        # World (y, z) from the corner to (along, up) of the board.
        self._outline = np.column_stack((board.along, board.up))
        self._corner = board.point(0.0, 0.0)
        self.reach = float(np.linalg.norm(self._positions, axis=1).max()) + self._radius

    def _rim(self, position: np.ndarray, axis: np.ndarray) -> np.ndarray:
        first = perpendicular(axis)
        angle = np.arange(RIM_POINTS)[:, None] * (2.0 * math.pi / RIM_POINTS)
        return position + self._radius * (np.cos(angle) * first + np.sin(angle) * np.cross(axis, first))

    def foremost(self, position: np.ndarray, rotation: np.ndarray) -> float:
        """Largest world x that any disc reaches [m], exact; negative: clear of board and wall."""
        slopes = self._axes @ rotation[0]
        fronts = self._positions @ rotation[0] + self._radius * np.sqrt(np.maximum(1.0 - slopes * slopes, 0.0))
        return float(position[0] + fronts.max())

    def strikes(self, position: Sequence[float], rotation: Sequence[Sequence[float]]) -> bool:
        """Whether any disc touches board or wall."""
        where, turn = np.array(position), np.array(rotation)
        if not self._surface.flat:
            return self.distance(where, turn) <= 0.0
        if position[0] + self.reach <= 0.0:
            return False
        return self.foremost(where, turn) > 0.0 and self.distance(where, turn) <= 0.0

    def distances(self, positions: np.ndarray, rotations: np.ndarray) -> np.ndarray:
        """`distance` of many poses at once [m], (N,), equal to rounding.

        Args:
            positions: (N, 3).
            rotations: (N, 3, 3).
        """
        blocks = [slice(start, start + BLOCK) for start in range(0, len(positions), BLOCK)]
        return np.concatenate([np.zeros(0), *(self._block(positions[block], rotations[block]) for block in blocks)])

    def _block(self, positions: np.ndarray, rotations: np.ndarray) -> np.ndarray:
        if not self._surface.flat:
            return self._before_curve(positions, rotations)
        axes, hubs = self._axes @ rotations[:, 0].T, self._positions @ rotations[:, 0].T
        fronts = positions[:, 0] + hubs + self._radius * np.sqrt(np.maximum(1.0 - axes * axes, 0.0))
        to_board = np.zeros((3, 3))  # from the world to (x, along, up) of the board
        to_board[0, 0], to_board[1:, 1:] = 1.0, self._outline.T
        start = (positions - np.append(0.0, self._corner)) @ to_board.T
        x, along, up = self._rims.reshape(-1, 3) @ np.moveaxis(to_board @ rotations, 0, 2) + start.T[:, None, :]
        width, height = self._size
        inside = (along >= 0.0) & (along <= width) & (up >= 0.0) & (up <= height)
        ahead = np.where(inside, x, -math.inf).max(axis=0)
        return np.minimum(self._gap - fronts.max(axis=0), -ahead)

    def _before_curve(self, positions: np.ndarray, rotations: np.ndarray) -> np.ndarray:
        """The same before a curved wall, by the rims alone."""
        rims = self._rims.reshape(-1, 3) @ np.moveaxis(rotations, 1, 2) + positions[:, None, :]
        chart = self._surface.chart(rims)
        along_up = (chart[..., 1:] - self._corner) @ self._outline
        inside = ((along_up >= 0.0) & (along_up <= self._size)).all(axis=-1)
        return (np.where(inside, 0.0, self._gap) - chart[..., 0]).min(axis=1)

    def distance(self, position: np.ndarray, rotation: np.ndarray) -> float:
        """Smallest distance of any disc to the surface straight ahead of it [m]; negative inside a surface.

        Args:
            position: Body origin, world NED [m], (3,).
            rotation: Rotation B to I, (3, 3).
        """
        return float(self._block(position[None], rotation[None])[0])
