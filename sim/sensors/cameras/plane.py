"""The default camera: board and wall are planes, so one homography each draws the picture; no OpenGL.

The board is drawn as a sheet at the wall's gap in front of it (its thin side faces are left out). Its outline cuts
the picture along straight lines: `_cut` draws the wall beyond one of them, with an antialiased rim.
"""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np

from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.measurement import RgbdFrame
from sim.sensors.cameras.finish import PictureFinish
from sim.sensors.cameras.outline import Box, CutLine
from sim.sensors.cameras.view import View, board_corners, board_steps
from sim.world.canvas import TEXTURE_PAD_PX, Canvas
from sim.world.scene import Scene

_SHIFT = 6  # sub-pixel bits of polygon corners
_EVEN, _HALF = np.uint32(0x00FF00FF), np.uint32(0x00800080)  # every other byte of a pixel, and its rounding
_WARP = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP


class _Sheet(NamedTuple):
    """Board or wall in one view."""

    texture: np.ndarray  # its picture, uint8 (h, w, 4)
    back: np.ndarray  # homography from picture to texture pixels, (3, 3)
    plane: tuple[float, float, float]  # (p, q, r) of 1/Z = p u + q v + r as measured

    @staticmethod
    def seen(
        view: View, texture: np.ndarray, steps: tuple[np.ndarray, np.ndarray, np.ndarray], common: float
    ) -> _Sheet:
        """A sheet whose texture has the (corner, column step, row step) ``steps`` in the world.

        The common-mode depth error is applied as the scale 1 + ``common``, equal to the offset at the picture's centre.
        """
        corner = steps[0]
        p, q, r = view.pixel_plane(float(corner[0]))
        scale = 1.0 / (1.0 + common)
        plane = float(p * scale), float(q * scale), float(r * scale)
        return _Sheet(texture, _inverse(view.from_texture(*steps)), plane)


class PlaneCamera:
    """RGB-D camera by homography of the painted board and the wall, with analytic depth.

    Args:
        scene: Board, wall and camera.
        vehicle: Where camera, arm and propellers are.
        canvas: The board's and the wall's pictures; read at every capture.
        seed: Seed of the noise.
        noise: Whether to add colour and depth noise and depth holes.
    """

    def __init__(self, scene: Scene, vehicle: VehicleParams, canvas: Canvas, seed: int, noise: bool = True) -> None:
        self.scene, self.vehicle, self.canvas = scene, vehicle, canvas
        self.finish = PictureFinish(scene, vehicle, seed, noise)
        self.intrinsics = self.finish.intrinsics
        shape = (scene.camera.height, scene.camera.width)
        self._corners = board_corners(canvas.geometry)
        self._board_steps = board_steps(canvas.geometry, canvas.pixels_per_m, TEXTURE_PAD_PX)
        step = 1.0 / canvas.wall_pixels_per_m
        corner = np.append(scene.board.gap_m, canvas.wall_origin + 0.5 * step)
        self._wall_steps = corner, np.array([0.0, step, 0.0]), np.array([0.0, 0.0, step])
        self._plain_wall = (*(float(entry) for entry in scene.wall.color), 255.0)
        self._picture, self._behind = np.empty((*shape, 4), np.uint8), np.empty((*shape, 4), np.uint8)
        self._mask = np.zeros(shape, np.uint8)
        self.inverse, self._inverse_behind = np.empty(shape, np.float32), np.empty(shape, np.float32)
        self.drawn_rgb, self.shiny = np.empty((*shape, 3), np.uint8), np.zeros(0, np.intp)
        self._v, self._u = np.indices(shape, np.float32)

    def capture(
        self,
        position_ned: np.ndarray,
        quaternion_b_in_i: np.ndarray,
        stamp_ns: int,
        twist: np.ndarray | None = None,
    ) -> RgbdFrame:
        """Take a picture, see `sim.sensors.cameras.protocol.Camera`; the frame owns its arrays."""
        view = View.of_vehicle(position_ned, quaternion_b_in_i, self.vehicle.camera_position_m, self.intrinsics)
        cuts = self.draw(view, self.finish.common_error(view))
        rgb = self.finish.color(self.drawn_rgb, view, twist, stamp_ns)
        depth = self.finish.depth(self.inverse, [*self.finish.holes(cuts), self.shiny])
        return RgbdFrame(rgb=rgb, depth=depth, intrinsics=self.intrinsics, stamp_ns=stamp_ns)

    def draw(self, view: View, common: float) -> list[CutLine]:
        """Draw board and wall into `drawn_rgb` and `inverse`, and where wet paint has no depth into `shiny`.

        Returns the lines of the outline in the picture.

        Args:
            view: Pose of the camera.
            common: Common-mode error of the depth, relative.
        """
        texture = self.canvas.flush()
        cuts, board_box = self.finish.outline(view, self._corners)
        wall = _Sheet.seen(view, self.canvas.wall, self._wall_steps, common)
        board = None if board_box is None else _Sheet.seen(view, texture, self._board_steps, common)
        if board is not None and board_box is not None:
            self._draw(board, board_box, self._picture, self.inverse)
        for cut in cuts:
            self._cut(wall, cut)
        cv2.cvtColor(self._picture, cv2.COLOR_RGBA2RGB, self.drawn_rgb)
        self.shiny = self.finish.go_outside(self.drawn_rgb, view, self.canvas)
        return cuts

    def _draw(self, sheet: _Sheet, box: Box, picture: np.ndarray, inverse: np.ndarray) -> None:
        """Colours and inverse depths of a sheet within a box."""
        r0, r1, c0, c1 = box
        if r0 >= r1 or c0 >= c1:
            return
        back = sheet.back.copy()
        back[:, 2] += back[:, 0] * c0 + back[:, 1] * r0
        # A constant border is the fast one: OpenCV's others cost five times as much where the texture ends.
        border, size = self._plain_wall, (c1 - c0, r1 - r0)
        cv2.warpPerspective(sheet.texture, back, size, picture[r0:r1, c0:c1], _WARP, cv2.BORDER_CONSTANT, border)
        along_u, along_v, constant = sheet.plane
        u, v = self._u[r0:r1, c0:c1], self._v[r0:r1, c0:c1]
        cv2.addWeighted(u, along_u, v, along_v, constant, inverse[r0:r1, c0:c1])

    def _cut(self, wall: _Sheet, cut: CutLine) -> None:
        """Draw the wall beyond one line of the board's outline."""
        beyond, band = cut.split()
        self._draw(wall, beyond, self._picture, self.inverse)
        r0, r1, c0, c1 = band
        if r0 >= r1 or c0 >= c1:
            return
        self._draw(wall, band, self._behind, self._inverse_behind)
        places, fraction = cut.rim(band)
        picture = self._picture.view(np.uint32).reshape(-1)
        mixed = _mix(picture.take(places), self._behind.view(np.uint32).reshape(-1).take(places), fraction)
        mask = self._mask[r0:r1, c0:c1]
        mask[:] = 0
        if len(cut.beyond):
            corners = np.rint((cut.beyond - (c0, r0)) * (1 << _SHIFT)).astype(np.int32)
            cv2.fillConvexPoly(mask, corners, 255.0, cv2.LINE_8, _SHIFT)
        cv2.copyTo(self._behind[r0:r1, c0:c1], mask, self._picture[r0:r1, c0:c1])
        cv2.copyTo(self._inverse_behind[r0:r1, c0:c1], mask, self.inverse[r0:r1, c0:c1])
        picture[places] = mixed


def _inverse(matrix: np.ndarray) -> np.ndarray:
    """Inverse of a 3 x 3 matrix by cofactors, in a fraction of the general one's time."""
    (a, b, c), (d, e, f), (g, h, i) = matrix.tolist()
    rows = (
        (e * i - f * h, c * h - b * i, b * f - c * e),
        (f * g - d * i, a * i - c * g, c * d - a * f),
        (d * h - e * g, b * g - a * h, a * e - b * d),
    )
    return np.array(rows) / (a * rows[0][0] + b * rows[1][0] + c * rows[2][0])


def _mix(front: np.ndarray, behind: np.ndarray, fraction: np.ndarray) -> np.ndarray:
    """Pixels, uint32 of four bytes, mixed with the weight of the front one in 256ths; two bytes at a time."""
    rest = np.uint32(256) - fraction
    even = ((front & _EVEN) * fraction + (behind & _EVEN) * rest + _HALF) >> np.uint32(8)
    odd = ((front >> np.uint32(8)) & _EVEN) * fraction + ((behind >> np.uint32(8)) & _EVEN) * rest + _HALF
    return (even & _EVEN) | (odd & ~_EVEN)
