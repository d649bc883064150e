"""A real camera, turned and with a lens, and the ideal one in its place: points of both, and rectified pictures."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

#: Steps after OpenCV's own five, and accuracy [-], of the removal of a lens: 0.001 px at usual focal lengths.
_STEPS, _ACCURACY = 20, 1e-6
#: Larger errors are of pixels outside the range of a lens model, which has no ray for them [-].
_NO_RAY = 1e-3
#: Least depth of a ray of the real camera per depth in C [-]: the others come from the side or from behind.
_LEAST_DEPTH = 0.1


def camera_matrix(intrinsics: Sequence[float]) -> np.ndarray:
    """OpenCV's camera matrix of (fx, fy, cx, cy) [px], (3, 3)."""
    fx, fy, cx, cy = intrinsics
    return np.array(((fx, 0.0, cx), (0.0, fy, cy), (0.0, 0.0, 1.0)))


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
