"""The raw pictures of an RGB-D camera as the one registered, rectified picture that perception takes."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence

import cv2
import numpy as np

from ibvs_qp.config.field_of_view import straightened_intrinsics
from ibvs_qp.measurement import RgbdFrame
from ibvs_qp.vision.checks import frame_problem
from ibvs_qp.vision.compilation import inner, kernel
from ibvs_qp.vision.picture.picture import camera_matrix
from ibvs_qp.vision.picture.settings import RgbdCameraSettings

#: Steps after OpenCV's own five, and accuracy [-], of the removal of a lens: 0.001 px at usual focal lengths.
_STEPS, _ACCURACY = 20, 1e-6
#: Larger errors are of pixels outside the range of a lens model, which has no ray for them [-].
_NO_RAY = 1e-3
#: Least depth of a ray of the real camera per depth in C [-]: the others come from the side or from behind.
_LEAST_DEPTH = 0.1
#: Longest side of a depth picture [px].
_LARGEST = 4096
#: A reading hides another that is farther by this fraction; closer ones are of the same surface.
_HIDES = np.float32(0.01)
#: Both sides of a crack agree to this fraction, and the surface that shows through is farther by more.
_AGREES = np.float32(0.02)
_ONE, _HALF = np.float32(1.0), np.float32(0.5)
#: Beyond every picture [px].
_FAR = np.float32(1e6)


class Lens:
    """A lens and its mount: the view of a real camera along R' r is that of the ideal one along r.

    Args:
        distortion: Coefficients in OpenCV's order; none for an ideal lens.
        rotation: R from the real camera's axes to the ideal one's, (3, 3).
    """

    def __init__(self, distortion: Sequence[float] = (), rotation: np.ndarray | None = None) -> None:
        self.distortion = np.array(distortion, float)
        self.rotation = np.eye(3) if rotation is None else rotation

    @property
    def none(self) -> bool:
        """Whether real and ideal picture are the same."""
        return not self.distortion.any() and np.array_equal(self.rotation, np.eye(3))

    def ideal(self, pixels: np.ndarray, intrinsics: Sequence[float]) -> np.ndarray:
        """Normalised points of the ideal camera, (n, 2), of pixels of the real one, (n, 2)."""
        rays = self.rays(pixels, intrinsics) @ self.rotation.T
        return rays[:, :2] / rays[:, 2:]

    def rays(self, pixels: np.ndarray, intrinsics: Sequence[float]) -> np.ndarray:
        """Rays (x, y, 1) in the real camera's own axes, (n, 3), of its pixels, (n, 2); NaN beyond the lens model."""
        fx, fy, cx, cy = intrinsics
        seen = (np.asarray(pixels, float).reshape(-1, 2) - (cx, cy)) / (fx, fy)
        points = seen
        if self.distortion.any():
            points = self._straight(seen)
        return np.column_stack((points, np.ones(len(points))))

    def _straight(self, seen: np.ndarray) -> np.ndarray:
        """Normalised points without the lens, (n, 2), of those behind it."""
        points = cv2.undistortPoints(seen[:, None], np.eye(3), self.distortion)[:, 0]
        with np.errstate(all="ignore"):
            error = self._error(points, seen)
            for _ in range(_STEPS):
                if not (np.abs(error) > _ACCURACY).any():
                    break
                points = points + error
                error = self._error(points, seen)
        points[~(np.abs(error).max(axis=1) < _NO_RAY)] = np.nan
        return points

    def _error(self, points: np.ndarray, seen: np.ndarray) -> np.ndarray:
        return seen - _bent(np.column_stack((points, np.ones(len(points)))), np.eye(3), self.distortion)

    def pixels(self, points: np.ndarray, intrinsics: Sequence[float]) -> np.ndarray:
        """Pixels of the real camera, (n, 2), of normalised points of the ideal one, (n, 2)."""
        rays = np.column_stack((points, np.ones(len(points)))) @ self.rotation
        return _bent(rays, camera_matrix(intrinsics), self.distortion)


def _bent(rays: np.ndarray, matrix: np.ndarray, distortion: np.ndarray) -> np.ndarray:
    """Pixels, (n, 2), of rays in the camera's own axes, (n, 3)."""
    zero, lens = np.zeros(3), distortion if distortion.size else None
    return cv2.projectPoints(rays[:, None], zero, zero, matrix, lens)[0].reshape(-1, 2)


class Rectification:
    r"""Tables of one camera: the ray of every ideal pixel is looked up in the real picture.

    The pixel of the ray :math:`r` in C shows the view of the real camera along :math:`R^T r`, bent by its lens; a depth
    z of the real picture is :math:`z / (R^T r)_z` in C, with r scaled to a depth of 1. Beyond the border of the real
    picture the colour of the border goes on, so that no edge is added, and the depth is invalid.

    Args:
        lens: Lens and mount.
        shape: Height and width of the picture [px].
        intrinsics: (fx, fy, cx, cy) of the real picture [px].
        ideal: The same of the ideal picture.
    """

    def __init__(self, lens: Lens, shape: tuple[int, int], intrinsics: Sequence[float], ideal: Sequence[float]) -> None:
        fx, fy, cx, cy = ideal
        self._columns, self._rows = cv2.initUndistortRectifyMap(
            camera_matrix(intrinsics), lens.distortion, lens.rotation, camera_matrix(ideal), shape[::-1], cv2.CV_32FC1
        )
        x = (np.arange(shape[1]) - cx) / fx
        y = (np.arange(shape[0])[:, None] - cy) / fy
        a, b, c = lens.rotation.T[2]
        depth = (a * x + b * y + c).astype(np.float32)
        self._columns[depth < _LEAST_DEPTH] = -np.inf
        self._per_depth = 1.0 / np.maximum(depth, np.float32(_LEAST_DEPTH))

    def color(self, rgb: np.ndarray) -> np.ndarray:
        """The ideal picture, uint8 (H, W, 3), of a real one."""
        return cv2.remap(rgb, self._columns, self._rows, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)

    def depth(self, depth: np.ndarray) -> np.ndarray:
        """Depth in C [m], float32 (H, W), of depth registered to the real picture [m]."""
        real = depth.astype(np.float32, copy=False)
        return cv2.remap(real, self._columns, self._rows, cv2.INTER_NEAREST, borderValue=0) * self._per_depth


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
    """Colour of 8 bits, (H, W, 3), of a uint8 or uint16, (H, W), (H, W, 1) or (H, W, 3), with so many bits in use."""
    if type(picture) is not np.ndarray or picture.ndim not in (2, 3):
        return picture
    if picture.dtype.kind == "u" and picture.dtype.itemsize == 2:
        picture = np.minimum(picture >> (bits - 8), 255).astype(np.uint8)
    if picture.ndim == 2 or picture.shape[2] == 1:
        height, width = picture.shape[:2]
        picture = np.repeat(picture.reshape(height, width, 1), 3, axis=2)
    return picture


def to_metres(picture: np.ndarray, units_per_metre: float) -> np.ndarray:
    """Depth [m], float32 where the unit had to be changed; integers without a stated unit (1) stay as they are."""
    if type(picture) is not np.ndarray or picture.dtype.kind not in "uif" or units_per_metre == 1.0:
        return picture
    return picture.astype(np.float32) * np.float32(1.0 / units_per_metre)


class Registration:
    r"""Tables of one pair of cameras.

    A reading z along the ray r of the depth camera is the point :math:`M (z R r + t)` in C, with the pose (R, t) of the
    depth camera in the colour camera's axes and the mount M of the colour camera. The depth is registered to the
    rectified picture at once: nothing is resampled twice.

    Args:
        settings: Depth camera and its pose.
        mount: Rotation from the real colour camera's axes to C, (3, 3).
        shapes: Height and width of the depth picture, and of the colour picture [px].
        intrinsics: (fx, fy, cx, cy) of the ideal colour picture [px].
    """

    def __init__(
        self,
        settings: RgbdCameraSettings,
        mount: np.ndarray,
        shapes: tuple[tuple[int, int], tuple[int, int]],
        intrinsics: tuple[float, ...],
    ) -> None:
        (height, width), self._shape = shapes
        rows, columns = np.mgrid[:height, :width]
        pixels = np.stack((columns, rows), axis=-1).reshape(-1, 2)
        rays = Lens(settings.depth_distortion).rays(pixels, settings.depth_intrinsics)
        to_picture = camera_matrix(intrinsics) @ mount
        projected = rays @ (to_picture @ settings.depth_to_color).T
        self._rays = np.ascontiguousarray(projected.reshape(height, width, 3).transpose(0, 2, 1), np.float32)
        self._shift = (to_picture @ settings.depth_translation_m).astype(np.float32)
        self._half = _half_reading(projected.reshape(height, width, 3))
        self._nearest = np.empty(self._shape, np.float32)

    def depth(self, depth: np.ndarray) -> np.ndarray:
        """Depth in C [m], float32 (H, W), 0 where the depth camera has no reading or another object."""
        self._nearest.fill(0.0)
        readings = np.require(depth, np.float32, ("C", "W"))  # the one type of the kernel
        _project_depth(readings, self._rays, self._shift, self._half, self._nearest)
        closed = np.empty(self._shape, np.float32)
        _close_cracks(self._nearest, closed)
        return closed


def _half_reading(projected: np.ndarray) -> np.ndarray:
    """Half the columns and rows that a far reading covers [px], float32 (2,), of (h, w, 3) homogeneous pixels.

    The readings of a depth camera that is turned about its axis cover upright rectangles that overlap.
    """
    with np.errstate(all="ignore"):
        places = projected[..., :2] / projected[..., 2:]
    if min(places.shape[:2]) < 2:
        return np.full(2, 0.5, np.float32)
    right, down = np.abs(np.diff(places[:-1], axis=1)), np.abs(np.diff(places[:, :-1], axis=0))
    return np.nan_to_num(0.5 * np.nanmedian((right + down).reshape(-1, 2), axis=0)).astype(np.float32)


@kernel("void(f4[:, ::1], f4[:, :, ::1], f4[::1], f4[::1], f4[:, ::1])")
def _project_depth(depth, rays, shift, half, nearest):
    """Depth in the target picture (H, W), zero before, of every reading (h, w) [m], on all pixels that it covers.

    `rays` are those of every reading per depth: target column, row and 1, each times the target's depth, (h, 3, w);
    `shift` is the same of the source camera's centre [m], `half` half the size of a reading in the target [px], (2,).
    """
    height, width = depth.shape
    ahead, covered = np.empty(width, np.float32), np.empty((4, width), np.int32)
    for i in range(height):
        _cover(depth[i], rays[i], shift, half, nearest.shape, ahead, covered)
        for j in range(width):
            hidden = ahead[j] * (_ONE + _HIDES)
            for row in range(covered[0, j], covered[1, j]):
                for column in range(covered[2, j], covered[3, j]):
                    other = nearest[row, column]
                    if other == 0 or other > hidden:
                        nearest[row, column] = ahead[j]


@inner
def _cover(depth, rays, shift, half, shape, ahead, covered):
    """Depth in the target of a row of readings, (w,), and the rows and columns that they cover, (4, w).

    Rows are from ``covered[0]`` to before ``covered[1]``, columns from ``covered[2]`` to before ``covered[3]``; an
    empty range if out of view. One loop without jumps: the processor takes several readings at once.
    """
    rows, columns = np.float32(shape[0]), np.float32(shape[1])
    (wide, high), (a, b, c) = (half[0], half[1]), (shift[0], shift[1], shift[2])
    for j in range(len(depth)):
        z = depth[j]
        far = z * rays[2, j] + c
        scale = _ONE / far
        u, v = (z * rays[0, j] + a) * scale, (z * rays[1, j] + b) * scale
        seen = (z > 0) & (far > 0) & (u > -_ONE) & (v > -_ONE) & (u < columns) & (v < rows)  # false for NaN, too
        u, v = (u if seen else -_FAR), (v if seen else -_FAR)
        left, right = np.floor(u - wide) + _ONE, np.floor(u + wide) + _ONE
        top, bottom = np.floor(v - high) + _ONE, np.floor(v + high) + _ONE
        middle, level = np.floor(u + _HALF), np.floor(v + _HALF)
        thin, flat = left >= right, top >= bottom  # between the middles of two pixels: the nearer one
        left, right = (middle if thin else left), (middle + _ONE if thin else right)
        top, bottom = (level if flat else top), (level + _ONE if flat else bottom)
        ahead[j] = far
        covered[0, j] = np.int32(top if top > 0 else np.float32(0))
        covered[1, j] = np.int32(bottom if bottom < rows else rows)
        covered[2, j] = np.int32(left if left > 0 else np.float32(0))
        covered[3, j] = np.int32(right if right < columns else columns)


@inner
def _closed(z, a, b):
    """Depth of a pixel between two others: theirs if they agree and it has none, or one of something behind them."""
    near, far = min(a, b), max(a, b)
    if near > 0 and far - near <= _AGREES * near and (z == 0 or z > far * (_ONE + _AGREES)):
        return _HALF * (a + b)
    return z


@kernel("void(f4[:, ::1], f4[:, ::1])")
def _close_cracks(nearest, closed):
    """Write the depth [m] with cracks closed, first within rows, else within columns, (H, W) each."""
    rows, columns = nearest.shape
    for i in range(rows):
        for j in range(columns):
            z = nearest[i, j]
            closed[i, j] = _closed(z, nearest[i, j - 1], nearest[i, j + 1]) if 0 < j < columns - 1 else z
            if closed[i, j] == z and 0 < i < rows - 1:
                closed[i, j] = _closed(z, nearest[i - 1, j], nearest[i + 1, j])
