"""Depth of a camera beside the colour camera, as the ideal colour camera would measure it."""

from __future__ import annotations

import numpy as np

from ibvs_qp.vision.kernels.registration import close_cracks, project_depth
from ibvs_qp.vision.picture.lens import Lens, camera_matrix
from ibvs_qp.vision.picture.settings import RgbdCameraSettings


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
        """Depth in C [m], float32 (H, W), 0 where the depth camera sees nothing or something else."""
        self._nearest.fill(0.0)
        readings = np.require(depth, np.float32, ("C", "W"))  # the one type of the kernel
        project_depth(readings, self._rays, self._shift, self._half, self._nearest)
        closed = np.empty(self._shape, np.float32)
        close_cracks(self._nearest, closed)
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
