"""The raw pictures of an RGB-D camera as the one registered, rectified picture that perception takes."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np

from ibvs_qp.config.field_of_view import straightened_intrinsics
from ibvs_qp.measurement import RgbdFrame
from ibvs_qp.vision.checks import frame_problem
from ibvs_qp.vision.picture.lens import Lens, Rectification
from ibvs_qp.vision.picture.registration import Registration
from ibvs_qp.vision.picture.settings import RgbdCameraSettings

#: Longest side of a depth picture [px].
_LARGEST = 4096


class RgbdCamera:
    """Mono to colour, units to metres, depth to colour, the lens removed; tables are made at the first frame.

    The middle of a turned camera's picture stays in the middle: the principal point moves.

    Attributes:
        lens: Lens and mount of the colour camera.

    Args:
        settings: The camera.
        mount: Rotation from the colour camera's axes to the camera frame C of `ibvs_qp.frames`, (3, 3), or None.
        problem: Why a picture cannot be used, or None if it can.
    """

    def __init__(
        self,
        settings: RgbdCameraSettings | None = None,
        mount: np.ndarray | None = None,
        problem: Callable[[RgbdFrame], str | None] = frame_problem,
    ) -> None:
        self._settings, self._problem = settings or RgbdCameraSettings(), problem
        self.lens = Lens(self._settings.distortion, mount)
        self._key: tuple[object, ...] = ()
        self._intrinsics: tuple[float, float, float, float] = (1.0, 1.0, 0.0, 0.0)  # of the straightened picture
        self._rectification: Rectification | None = None
        self._registration: Registration | None = None
        if not self._settings.registered:  # compiled here, not at the first picture in flight
            tiny = Registration(self._settings, self.lens.rotation, ((1, 1), (1, 1)), self._intrinsics)
            tiny.depth(np.ones((1, 1), np.float32))

    def picture(self, raw: RgbdFrame) -> RgbdFrame:
        """The picture for perception; of a refused one, the readable part.

        Args:
            raw: Colour or mono, uint8 or uint16, (H, W) or (H, W, 3); depth in the stated unit, (h, w), of the same
                size where it is registered; intrinsics of the colour picture.
        """
        settings = self._settings
        rgb, depth = to_color(raw.rgb, settings.color_bits), to_metres(raw.depth, settings.depth_units_per_metre)
        frame = raw
        if rgb is not raw.rgb or depth is not raw.depth:
            frame = dataclasses.replace(raw, rgb=rgb, depth=depth)
        if not settings.registered:
            return self._registered(frame)
        if self.lens.none or self._problem(frame) is not None:
            return frame
        self._prepare(frame)
        assert self._rectification is not None
        rgb, depth = self._rectification.color(rgb), self._rectification.depth(depth)
        return dataclasses.replace(frame, rgb=rgb, depth=depth, intrinsics=self._intrinsics)

    def _registered(self, frame: RgbdFrame) -> RgbdFrame:
        if not (_is_depth(frame.depth) and type(frame.rgb) is np.ndarray):
            return frame
        # The checks are for registered pictures; the sizes of the two differ here.
        unknown = dataclasses.replace(frame, depth=np.broadcast_to(np.float32(0.0), frame.rgb.shape[:2]))
        if self._problem(unknown) is not None:
            return unknown
        self._prepare(frame)
        assert self._registration is not None
        rgb = frame.rgb if self._rectification is None else self._rectification.color(frame.rgb)
        depth = self._registration.depth(frame.depth)
        return dataclasses.replace(frame, rgb=rgb, depth=depth, intrinsics=self._intrinsics)

    def _prepare(self, frame: RgbdFrame) -> None:
        """Make the tables of a camera of another size or other intrinsics than the last one."""
        shape, intrinsics = frame.rgb.shape[:2], tuple(frame.intrinsics)
        key = frame.depth.shape, shape, intrinsics
        if key == self._key:
            return
        self._intrinsics = straightened_intrinsics(intrinsics, shape[::-1], self.lens.rotation)
        if not self.lens.none:
            self._rectification = Rectification(self.lens, shape, intrinsics, self._intrinsics)
        if not self._settings.registered:
            shapes = frame.depth.shape, shape
            self._registration = Registration(self._settings, self.lens.rotation, shapes, self._intrinsics)
        self._key = key


def _is_depth(depth: np.ndarray) -> bool:
    """Whether a depth picture, in metres by its type, can be registered."""
    if type(depth) is not np.ndarray or depth.ndim != 2 or depth.dtype.kind != "f":
        return False
    return 0 < min(depth.shape) and max(depth.shape) <= _LARGEST


def to_color(picture: np.ndarray, bits: int = 16) -> np.ndarray:
    """Colour of 8 bits, (H, W, 3), from a colour or mono picture.

    Args:
        picture: uint8 or uint16, (H, W), (H, W, 1) or (H, W, 3).
        bits: Bits in use of a uint16.
    """
    if type(picture) is not np.ndarray or picture.ndim not in (2, 3):
        return picture
    if picture.dtype.kind == "u" and picture.dtype.itemsize == 2:
        picture = np.minimum(picture >> (bits - 8), 255).astype(np.uint8)
    if picture.ndim == 2 or picture.shape[2] == 1:
        height, width = picture.shape[:2]
        picture = np.repeat(picture.reshape(height, width, 1), 3, axis=2)
    return picture


def to_metres(picture: np.ndarray, units_per_metre: float) -> np.ndarray:
    """Depth [m], float32 where the unit had to be changed.

    Args:
        picture: Integers or floating point, (H, W); integers without a stated unit stay as they are.
        units_per_metre: Values per metre, 1 for none stated.
    """
    if type(picture) is not np.ndarray or picture.dtype.kind not in "uif" or units_per_metre == 1.0:
        return picture
    return picture.astype(np.float32) * np.float32(1.0 / units_per_metre)
