"""Static part of the picture from outside: wall, floor, and the board with the paint of the moment."""

from __future__ import annotations

import cv2
import numpy as np

from sim.video.rasterizer import OVERSAMPLING, Rasterizer, light_on
from sim.video.shadow import cast, darken, shadow
from sim.world.canvas import TEXTURE_PAD_PX, Canvas
from sim.world.mujoco_frames import FLIP

#: Colour of the floor, red, green, blue 0..1.
_FLOOR = (0.56, 0.55, 0.53)
_OUTWARD, _UPWARD = np.array([-1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
#: Pixels around fresh paint that its filtering reaches [px].
_RIM_PX = 3


class Backdrop:
    """Wall, floor and board under one camera; nothing of the vehicle is ever behind them.

    Args:
        canvas: The board's picture; strokes on it appear at the next `refresh`.
        rasterizer: For its camera.

    Attributes:
        colour: The picture at the rasterizer's size, red, green, blue 0..1, float32.
        on_board: Fraction of every pixel of the finished picture that shows the board, float32.
    """

    def __init__(self, canvas: Canvas, rasterizer: Rasterizer) -> None:
        self._canvas = canvas
        board, gap, pad = canvas.scene.board, canvas.scene.board.gap_m, TEXTURE_PAD_PX
        height, width = rasterizer.depth.shape
        left, top = canvas.wall_origin
        right, bottom = canvas.wall_origin + np.array(canvas.wall.shape[1::-1]) / canvas.wall_pixels_per_m
        rims = np.array([(left, top), (right, top), (right, bottom), (left, bottom)])
        to_picture = _homography(rasterizer, canvas.wall, 0, rims, gap)
        # beyond the wall's picture its mirror image goes on
        wall = cv2.warpPerspective(canvas.wall, to_picture, (width, height), borderMode=cv2.BORDER_REFLECT)
        self._light = np.float32(light_on(_OUTWARD[None])[0] / 255.0)
        self.colour = wall[..., :3] * self._light
        self.colour[_shows_floor(rasterizer, gap)] = np.array(_FLOOR, np.float32) * light_on(_UPWARD[None])
        rims = canvas.geometry.point(np.array([0, 1, 1, 0]) * board.width_m, np.array([1, 1, 0, 0]) * board.height_m)
        outline = FLIP * np.column_stack((np.zeros(4), rims))
        darken(self.colour, shadow(rasterizer, [cast(outline, gap)], [1.0]))
        self._to_picture = _homography(rasterizer, canvas.texture, pad, rims, 0.0)
        self._inside = np.zeros(canvas.texture.shape[:2], np.float32)
        self._inside[pad:-pad, pad:-pad] = 1.0
        canvas.flush()
        self._lay_board(0, height, 0, width)
        share = cv2.warpPerspective(self._inside, self._to_picture, (width, height))
        self.on_board = cv2.resize(share, rasterizer.camera.size, interpolation=cv2.INTER_AREA)

    def refresh(self) -> None:
        """Bring `colour` up to date with the canvas."""
        if (box := self._canvas.refresh()) is None:
            return
        r0, r1, c0, c1 = box
        rims = np.array([[(c0, r0), (c1, r0), (c1, r1), (c0, r1)]], np.float32)
        seen = cv2.perspectiveTransform(rims, self._to_picture)[0]
        (left, top), (right, bottom) = np.floor(seen.min(axis=0)) - _RIM_PX, np.ceil(seen.max(axis=0)) + _RIM_PX
        height, width = self.colour.shape[:2]
        self._lay_board(max(int(top), 0), min(int(bottom), height), max(int(left), 0), min(int(right), width))

    def _lay_board(self, r0: int, r1: int, c0: int, c1: int) -> None:
        """Draw the board's texture into a box of the picture."""
        if r0 >= r1 or c0 >= c1:
            return
        into, size = np.array([(1, 0, -c0), (0, 1, -r0), (0, 0, 1.0)]) @ self._to_picture, (c1 - c0, r1 - r0)
        share = cv2.warpPerspective(self._inside, into, size)[..., None]
        drawn = cv2.warpPerspective(self._canvas.texture, into, size, borderMode=cv2.BORDER_REPLICATE)[..., :3]
        part = self.colour[r0:r1, c0:c1]
        part += share * (drawn * self._light - part)


def _homography(
    rasterizer: Rasterizer, texture: np.ndarray, pad: int, corners: np.ndarray, depth_m: float
) -> np.ndarray:
    """Map from the pixels of a picture to the rasterizer's; corners from the upper left, world NED (y, z) [m]."""
    height, width = texture.shape[:2]
    low, right, bottom = pad - 0.5, width - pad - 0.5, height - pad - 0.5  # borders of pixels, not centres
    source = np.array([(low, low), (right, low), (right, bottom), (low, bottom)], np.float32)
    world = FLIP * np.column_stack((np.full(4, depth_m), corners))
    target = OVERSAMPLING * rasterizer.camera.project(world) - 0.5
    return cv2.getPerspectiveTransform(source, target.astype(np.float32))


def _shows_floor(rasterizer: Rasterizer, wall_m: float) -> np.ndarray:
    """Whether the ray of a pixel meets the floor before the wall, (height, width) bool."""
    camera, (height, width) = rasterizer.camera, rasterizer.depth.shape
    focal = OVERSAMPLING * camera.focal_px
    across = (np.arange(width) + 0.5 - 0.5 * width) / focal
    upward = (0.5 * height - np.arange(height) - 0.5) / focal
    right, up, backward = camera.axes
    ahead, rising = (across * right[axis] + upward[:, None] * up[axis] - backward[axis] for axis in (0, 2))
    with np.errstate(divide="ignore"):
        met = camera.eye[0] - camera.eye[2] / rising * ahead
    return (rising < 0.0) & (met < wall_m)
