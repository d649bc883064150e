"""The OpenGL camera: MuJoCo's classic renderer, with the last stage of the plane camera."""

from __future__ import annotations

import cv2
import numpy as np

from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.measurement import RgbdFrame
from sim.sensors.cameras.finish import PictureFinish
from sim.sensors.cameras.gl_scene import GlScene
from sim.sensors.cameras.outline import CutLine
from sim.sensors.cameras.view import View, board_corners
from sim.world.canvas import TEXTURE_PAD_PX, Canvas
from sim.world.scene import Scene

#: Neighbours of a rim pixel that certainly lie on the board and on the wall [px].
_SURE_PX = 1


class GLCamera:
    """RGB-D camera by OpenGL, in one pass without shadows and multisampling.

    OpenGL draws board and wall. Rim pixels, which it leaves jagged, are mixed from their two neighbours with the
    fraction that the board covers. Vehicle, lens blur, noise and depth holes are those of `PlaneCamera`.

    Args:
        scene: Board, wall and camera.
        vehicle: Where camera, arm and propellers are.
        canvas: The board's and the wall's pictures; fresh paint is uploaded at every capture.
        seed: Seed of the noise.
        noise: Whether to add colour and depth noise and depth holes.
        smooth_rim: Whether jagged rims are mended.

    Raises:
        CameraUnavailable: When this machine has no OpenGL that works without a display.
    """

    def __init__(
        self,
        scene: Scene,
        vehicle: VehicleParams,
        canvas: Canvas,
        seed: int,
        noise: bool = True,
        smooth_rim: bool = True,
    ) -> None:
        self.scene, self.vehicle, self.canvas = scene, vehicle, canvas
        self.finish = PictureFinish(scene, vehicle, seed, noise)
        self.intrinsics = self.finish.intrinsics
        width, height = scene.camera.width, scene.camera.height
        self._corners, self._smooth_rim = board_corners(canvas.geometry), smooth_rim
        self._drawn = GlScene(
            canvas.geometry,
            (width, height),
            _face(canvas.flush()),
            canvas.wall,
            canvas.wall_origin,
            canvas.wall_pixels_per_m,
        )
        self.platform = self._drawn.platform
        self._rgb, self._inverse = np.empty((height, width, 3), np.uint8), np.empty((height, width), np.float32)

    def capture(
        self,
        position_ned: np.ndarray,
        quaternion_b_in_i: np.ndarray,
        stamp_ns: int,
        twist: np.ndarray | None = None,
    ) -> RgbdFrame:
        """Take a picture, see `sim.sensors.cameras.protocol.Camera`; the frame owns its arrays."""
        view = View.of_vehicle(position_ned, quaternion_b_in_i, self.vehicle.camera_position_m, self.intrinsics)
        changed = self.canvas.refresh()
        face = _face(self.canvas.texture)
        if changed is not None:
            box = _within(changed, face.shape)
            if box is not None:
                self._drawn.paint(face, box)
        rgb, inverse = self._drawn.draw(view)
        cv2.flip(rgb, 0, self._rgb)
        cv2.flip(inverse, 0, self._inverse)
        cuts, _ = self.finish.outline(view, self._corners)
        if self._smooth_rim:
            for cut in cuts:
                _mend_rim(self._rgb, cut)
        shiny = self.finish.go_outside(self._rgb, view, self.canvas)
        common = self.finish.common_error(view)
        if common != 0.0:
            np.multiply(self._inverse, np.float32(1.0 / (1.0 + common)), out=self._inverse)
        color = self.finish.color(self._rgb, view, twist, stamp_ns)
        depth = self.finish.depth(self._inverse, [*self.finish.holes(cuts), shiny])
        return RgbdFrame(rgb=color, depth=depth, intrinsics=self.intrinsics, stamp_ns=stamp_ns)

    def close(self) -> None:
        """Free the OpenGL context; happens by itself when the camera is gone."""
        self._drawn.close()


def _face(texture: np.ndarray) -> np.ndarray:
    """The texture without its padding; a view."""
    return texture[TEXTURE_PAD_PX:-TEXTURE_PAD_PX, TEXTURE_PAD_PX:-TEXTURE_PAD_PX]


def _within(box: tuple[int, int, int, int], shape: tuple[int, ...]) -> tuple[int, int, int, int] | None:
    """A box of the padded texture in rows and columns of the face, or None if it lies beyond the outline."""
    r0, r1, c0, c1 = (entry - TEXTURE_PAD_PX for entry in box)
    r0, r1, c0, c1 = max(r0, 0), min(r1, shape[0]), max(c0, 0), min(c1, shape[1])
    return (r0, r1, c0, c1) if r0 < r1 and c0 < c1 else None


def _mend_rim(picture: np.ndarray, cut: CutLine) -> None:
    """Mix the pixels along one edge of the board's outline from the neighbours on its two sides, in place."""
    height, width = cut.shape
    places, fraction = cut.rim((0, height, 0, width))
    near, far = places.reshape(2, -1)  # the two pixels that the edge passes between, smaller index first
    count = len(near)
    along = np.arange(count, dtype=float)
    axis = 1 - int(cut.flat)
    first, last = sorted((float(cut.start[axis]), float(cut.stop[axis])))
    used = np.flatnonzero((along >= first) & (along <= last))
    step = (width if cut.flat else 1) * _SURE_PX
    size = height * width - 1
    before, behind = np.maximum(near[used] - step, 0), np.minimum(far[used] + step, size)
    board, wall = (behind, before) if cut.normal[int(cut.flat)] > 0 else (before, behind)
    flat = picture.reshape(-1, 3)
    on, off = flat[board].astype(np.float32), flat[wall].astype(np.float32)
    for row, part in zip((near, far), fraction.reshape(2, -1), strict=True):
        weight = part[used, None].astype(np.float32) * np.float32(1.0 / 256.0)
        flat[row[used]] = np.rint(off + weight * (on - off)).astype(np.uint8)
