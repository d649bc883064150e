"""Colour, and depth registered to it, as an ideal camera takes them."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from ibvs_qp.vision.picture.lens import Lens, camera_matrix

#: Least depth of a ray of the real camera per depth in C [-]: the others come from beside or behind it.
LEAST_DEPTH = 0.1


class Rectification:
    r"""Tables of one camera: the ray of every ideal pixel is looked up in the real picture.

    The pixel of the ray :math:`r` in C shows what the real camera sees along :math:`R^T r`, bent by its lens; a depth z
    of the real picture is :math:`z / (R^T r)_z` in C, with r scaled to a depth of 1. Beyond the border of the real
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
        self._columns[depth < LEAST_DEPTH] = -np.inf
        self._per_depth = 1.0 / np.maximum(depth, np.float32(LEAST_DEPTH))

    def color(self, rgb: np.ndarray) -> np.ndarray:
        """The ideal picture, uint8 (H, W, 3), of a real one."""
        return cv2.remap(rgb, self._columns, self._rows, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)

    def depth(self, depth: np.ndarray) -> np.ndarray:
        """Depth in C [m], float32 (H, W), of depth registered to the real picture [m]."""
        real = depth.astype(np.float32, copy=False)
        return cv2.remap(real, self._columns, self._rows, cv2.INTER_NEAREST, borderValue=0) * self._per_depth
