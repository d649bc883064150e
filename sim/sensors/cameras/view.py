"""Projection of the two planes of the scene, board and wall, into a picture taken from a given pose."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ibvs_qp.frames import R_BODY_CAMERA, rotation_from_quaternion
from sim.world.board import BoardGeometry


@dataclass(frozen=True)
class View:
    """One camera pose."""

    rotation: np.ndarray  # world to camera, (3, 3)
    center: np.ndarray  # camera centre in the world [m], (3,)
    intrinsics: tuple[float, float, float, float]  # (fx, fy, cx, cy) [px]

    @staticmethod
    def of_vehicle(
        position_ned: np.ndarray,
        quaternion_b_in_i: np.ndarray,
        camera_position: np.ndarray | tuple[float, float, float],
        intrinsics: tuple[float, float, float, float],
    ) -> View:
        """The view of a camera fixed at ``camera_position`` [m] in the body, looking along body +x."""
        attitude = rotation_from_quaternion(quaternion_b_in_i)
        center = np.asarray(position_ned, float) + attitude @ np.asarray(camera_position, float)
        return View(R_BODY_CAMERA.T @ attitude.T, center, intrinsics)

    @property
    def matrix(self) -> np.ndarray:
        """Camera matrix K, (3, 3)."""
        fx, fy, cx, cy = self.intrinsics
        return np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])

    def to_camera(self, points: np.ndarray) -> np.ndarray:
        """Camera coordinates of world points [m], (..., 3)."""
        return (np.asarray(points, float) - self.center) @ self.rotation.T

    def pixels(self, points: np.ndarray) -> np.ndarray:
        """Pixels (u, v) of world points, (..., 2)."""
        fx, fy, cx, cy = self.intrinsics
        x, y, z = np.moveaxis(self.to_camera(points), -1, 0)
        return np.stack((fx * x / z + cx, fy * y / z + cy), axis=-1)

    def plane(self, x_m: float) -> np.ndarray:
        """Inverse depth of the world plane x = ``x_m``: 1/Z = a X/Z + b Y/Z + c, (a, b, c) in camera coordinates."""
        return self.rotation[:, 0] / (x_m - self.center[0])

    def pixel_plane(self, x_m: float) -> tuple[float, float, float]:
        """The same plane over pixels: 1/Z = p u + q v + r."""
        (a, b, c), (fx, fy, cx, cy) = self.plane(x_m), self.intrinsics
        return a / fx, b / fy, c - a * cx / fx - b * cy / fy

    def from_texture(self, corner: np.ndarray, column: np.ndarray, row: np.ndarray) -> np.ndarray:
        """Homography from texture pixels (column, row) to picture pixels, (3, 3).

        Args:
            corner: World position of the centre of texture pixel (0, 0) [m], (3,).
            column: World step from one column to the next [m], (3,).
            row: World step from one row to the next [m], (3,).
        """
        steps = np.array((column, row, corner - self.center)).T
        return self.matrix @ (self.rotation @ steps)


def board_corners(geometry: BoardGeometry) -> np.ndarray:
    """World corners of the board: bottom left, bottom right, top right, top left [m], (4, 3)."""
    board = geometry.scene.board
    yz = geometry.point(np.array([0.0, 1, 1, 0]) * board.width_m, np.array([0.0, 0, 1, 1]) * board.height_m)
    return np.column_stack((np.zeros(4), yz))


def board_steps(
    geometry: BoardGeometry, pixels_per_m: float, pad_px: int = 0
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """World (corner, column step, row step) of the board texture, see `View.from_texture`.

    Args:
        geometry: The board.
        pixels_per_m: Resolution of the texture [px/m].
        pad_px: By how much the texture exceeds the board on every side [px].
    """
    step = 1.0 / pixels_per_m
    beyond = (0.5 - pad_px) * step
    corner = geometry.point(beyond, geometry.scene.board.height_m - beyond)
    column, row = geometry.along * step, -geometry.up * step
    return np.append(0.0, corner), np.append(0.0, column), np.append(0.0, row)
