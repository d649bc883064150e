"""RGB-D pictures of `rigid_body.py`: a bright board on a dark wall, and the paint of the brush on it."""

import cv2
import numpy as np
from rigid_body import WALL_M, Vehicle

from ibvs_qp import RgbdFrame
from ibvs_qp.frames import R_BODY_CAMERA

WIDTH, HEIGHT, FOCAL_PX = 640, 480, 600.0
WALL, BOARD, PAINT = (110, 95, 80), (235, 235, 228), (40, 90, 200)  # RGB
PX_PER_M, BRUSH_M = 1000.0, 0.04  # of the drawing of the wall; radius of the brush
PATCH_M = (-2.0, -1.5, 2.0, 1.5)  # the part of the wall that is drawn: left, top, right, bottom
NOISE = 2.0  # of a pixel's colour


class DrawnCamera:
    """Paints on a flat drawing of the wall and shows it in perspective."""

    def __init__(self, board_m: tuple[float, float, float, float]) -> None:
        """The board's left, top, right and bottom edge, to the right and down from the world's origin [m]."""
        left, top, right, bottom = PATCH_M
        self._wall = np.full((round((bottom - top) * PX_PER_M), round((right - left) * PX_PER_M), 3), WALL, np.uint8)
        cv2.rectangle(self._wall, self._pixel(*board_m[:2]), self._pixel(*board_m[2:]), BOARD, cv2.FILLED)
        self._random = np.random.default_rng(0)
        self.intrinsics = (FOCAL_PX, FOCAL_PX, 0.5 * (WIDTH - 1), 0.5 * (HEIGHT - 1))
        columns, rows = np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT))
        self._rays = [(columns - self.intrinsics[2]) / FOCAL_PX, (rows - self.intrinsics[3]) / FOCAL_PX]

    @staticmethod
    def _pixel(right: float, down: float) -> tuple[int, int]:
        return round((right - PATCH_M[0]) * PX_PER_M), round((down - PATCH_M[1]) * PX_PER_M)

    def touch(self, tip: np.ndarray) -> None:
        """Paint where the brush touches the wall; the tip in the world [m], (3,)."""
        cv2.circle(self._wall, self._pixel(tip[1], tip[2]), round(BRUSH_M * PX_PER_M), PAINT, cv2.FILLED, cv2.LINE_AA)

    def picture(self, vehicle: Vehicle, stamp_ns: int) -> RgbdFrame:
        """Colour and registered depth of this moment."""
        fx, fy, cx, cy = self.intrinsics
        lens = np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])
        turn = R_BODY_CAMERA.T @ vehicle.turn.inv().as_matrix()  # axes of the world to those of the camera
        corner = vehicle.in_camera(np.array((WALL_M, PATCH_M[0], PATCH_M[1])))
        to_picture = lens @ np.column_stack((turn[:, 1] / PX_PER_M, turn[:, 2] / PX_PER_M, corner))
        rgb = cv2.warpPerspective(self._wall, to_picture, (WIDTH, HEIGHT), flags=cv2.INTER_LINEAR, borderValue=WALL)
        rgb = rgb + NOISE * self._random.standard_normal(rgb.shape, np.float32)
        a, b, c, _ = vehicle.plane()
        depth = 1.0 / (a * self._rays[0] + b * self._rays[1] + c)
        depth *= 1.0 + 0.003 * self._random.standard_normal(depth.shape)
        return RgbdFrame(
            rgb=rgb.clip(0, 255).astype(np.uint8),
            depth=depth.astype(np.float32),
            intrinsics=self.intrinsics,
            stamp_ns=stamp_ns,
        )
