"""The paper's normal image: filtered depth, its gradients, and a unit normal for every pixel."""

from __future__ import annotations

import cv2
import numpy as np

from ibvs_qp.vision.paper.config import PaperConfig
from ibvs_qp.vision.picture.layout import Intrinsics

#: Largest number of a 16-bit picture.
_LARGEST = 65535.0
#: Keeps the length of a normal from being zero where there is no depth at all.
_TINY = np.float32(1e-12)


class NormalImage:
    r"""Unit normals into the surface from the gradient of the depth.

    :math:`n \propto (-f_x z_u,\ -f_y z_v,\ z + (u - c_x) z_u + (v - c_y) z_v)`: the paper's formula with the mirrored
    sign mended and without its neglect of the off-axis term (10 degrees at the border of an oblique surface).

    All arrays are allocated once; a picture needs some twenty passes over them and no memory.

    Args:
        shape: (height, width) of the depth pictures [px].
        intrinsics: (fx, fy, cx, cy) [px].
        config: Settings.

    Attributes:
        stride: Depth readings per normal along rows and columns.
        shape: (rows, columns) of the normal image.
        x: Components of the normals in C, float32 (rows, columns); likewise y and z.
        depth: Filtered depth [m], float32 (rows, columns); 0 without a reading.
    """

    def __init__(self, shape: tuple[int, int], intrinsics: Intrinsics, config: PaperConfig) -> None:
        height, width = shape
        scale = width / 640.0
        self.stride = config.normal_stride
        rows, columns = -(-height // self.stride), -(-width // self.stride)
        self.shape = (rows, columns)
        fx, fy, cx, cy = intrinsics
        self._unit, self._median = config.depth_unit_m, config.median_px | 1
        self._window = _odd(config.smooth_px * scale / self.stride)
        self._reach = max(1, round(0.5 * config.baseline_px * scale / self.stride))
        baseline = 2.0 * self._reach * self.stride
        self._gain_x, self._gain_y = fx / baseline, fy / baseline
        u, v = np.arange(columns) * self.stride, np.arange(rows) * self.stride
        self.ray_x = np.tile(((u - cx) / fx).astype(np.float32), (rows, 1))
        self.ray_y = np.repeat(((v - cy) / fy).astype(np.float32)[:, None], columns, axis=1)
        self._numbers = np.zeros((rows, columns), np.float32)
        self._raw, self._filtered = np.zeros((rows, columns), np.uint16), np.zeros((rows, columns), np.uint16)
        self._one, self._two = np.zeros((rows, columns), np.float32), np.zeros((rows, columns), np.float32)
        self.depth = np.zeros((rows, columns), np.float32)
        self.x, self.y, self.z = (np.zeros((rows, columns), np.float32) for _ in range(3))

    def update(self, depth: np.ndarray) -> None:
        """Compute the normals of a picture.

        Args:
            depth: Depth [m], float32 (height, width), 0 or not finite where invalid.
        """
        self._filter(depth)
        k, z = self._reach, self.depth
        x, y, one, two = self.x, self.y, self._one, self._two
        # z_u fx and z_v fy; the borders keep 0 and are never looked at
        cv2.addWeighted(z[:, 2 * k :], self._gain_x, z[:, : -2 * k], -self._gain_x, 0.0, x[:, k:-k])
        cv2.addWeighted(z[2 * k :], self._gain_y, z[: -2 * k], -self._gain_y, 0.0, y[k:-k])
        cv2.multiply(self.ray_x, x, one)
        cv2.add(z, one, self.z)
        cv2.multiply(self.ray_y, y, one)
        cv2.add(self.z, one, self.z)
        cv2.multiply(self.z, self.z, two)
        cv2.accumulateSquare(x, two)
        cv2.accumulateSquare(y, two)
        np.maximum(two, _TINY, out=two)
        cv2.sqrt(two, two)
        cv2.divide(x, two, x, -1.0)
        cv2.divide(y, two, y, -1.0)
        cv2.divide(self.z, two, self.z)

    @property
    def support(self) -> int:
        """Side of the window of readings that one normal is made of [normals]."""
        return 2 * self._reach + self._window + self._median - 1

    @property
    def border(self) -> int:
        """Width of the rim without normals [normals]."""
        return self._reach

    def _filter(self, depth: np.ndarray) -> None:
        """Median against speckles and pinholes, mean against noise."""
        source = depth if self.stride == 1 else depth[:: self.stride, :: self.stride]
        np.multiply(source, np.float32(1.0 / self._unit), out=self._numbers)
        # not a number, negative and out of reach become 0: no reading
        cv2.patchNaNs(self._numbers, 0.0)
        cv2.threshold(self._numbers, 0.0, 0.0, cv2.THRESH_TOZERO, self._numbers)
        cv2.threshold(self._numbers, _LARGEST, 0.0, cv2.THRESH_TOZERO_INV, self._numbers)
        np.copyto(self._raw, self._numbers, casting="unsafe")
        cv2.medianBlur(self._raw, self._median, self._filtered)
        window = (self._window, self._window)
        cv2.boxFilter(self._filtered, cv2.CV_32F, window, self.depth, normalize=True, borderType=cv2.BORDER_REPLICATE)
        np.multiply(self.depth, np.float32(self._unit), out=self.depth)


def _odd(size: float) -> int:
    """Nearest odd window size."""
    return max(1, 2 * round(0.5 * (size - 1.0)) + 1)
