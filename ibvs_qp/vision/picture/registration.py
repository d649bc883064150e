"""Depth of a camera next to the colour camera, as the ideal colour camera would measure it.

Forward projection with a z-buffer, and cracks of one pixel closed.
"""

from __future__ import annotations

import numpy as np

from ibvs_qp.vision.compilation import inner, kernel
from ibvs_qp.vision.picture.lens import Lens, camera_matrix
from ibvs_qp.vision.picture.settings import RgbdCameraSettings

#: A reading hides another that is farther by this fraction; closer ones are of the same surface.
_HIDES = np.float32(0.01)
#: Both sides of a crack agree to this fraction, and the surface that shows through is farther by more.
_AGREES = np.float32(0.02)
_ONE, _HALF = np.float32(1.0), np.float32(0.5)
#: Beyond every picture [px].
_FAR = np.float32(1e6)


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
def _project_depth(
    depth: np.ndarray, rays: np.ndarray, shift: np.ndarray, half: np.ndarray, nearest: np.ndarray
) -> None:
    """Depth in the target picture of every reading, on all pixels that it covers.

    Args:
        depth: Readings [m], (h, w); not above 0 for none.
        rays: Of every reading per depth: target column, row and 1, each times the target's depth, (h, 3, w).
        shift: The same of the source camera's centre [m], (3,).
        half: Half the width and height of a reading in the target [px], (2,).
        nearest: Depth of the target [m], (H, W), zero before.
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
def _close_cracks(nearest: np.ndarray, closed: np.ndarray) -> None:
    """Write the depth [m] with cracks closed, first within rows, else within columns, (H, W) each."""
    rows, columns = nearest.shape
    for i in range(rows):
        for j in range(columns):
            z = nearest[i, j]
            closed[i, j] = _closed(z, nearest[i, j - 1], nearest[i, j + 1]) if 0 < j < columns - 1 else z
            if closed[i, j] == z and 0 < i < rows - 1:
                closed[i, j] = _closed(z, nearest[i - 1, j], nearest[i + 1, j])
