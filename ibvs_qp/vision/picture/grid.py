"""The coarse grid on which depth and colour are read: a few thousand samples stand for the whole picture."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import ArrayLike

from ibvs_qp.measurement import RgbdFrame
from ibvs_qp.vision.compilation import kernel
from ibvs_qp.vision.config import PlaneConfig
from ibvs_qp.vision.picture.mask import Intrinsics

#: Whole pixels need no table of fractions.
_WHOLE = np.empty((0, 0), np.uint16)
#: Types that OpenCV can read at places.
_FAST = (np.dtype(np.uint8), np.dtype(np.float32))
#: Samples all over the picture for its light, up to twice as many; more cost time and change nothing.
_SPREAD = 600


class CoarseGrid:
    """Sample places of one picture size and camera.

    Attributes:
        stride: Distance of samples [px].
        offset: Place of the first one in row and column [px].
        shape: (rows, columns) of the grid.
        free: Samples the vehicle does not hide, bool (rows, columns).
        pixels: Columns u and rows v of the samples [px], (rows, columns) each.
        design: Columns x, y, 1 in normalised coordinates, (rows * columns, 3).
        corners: The same of the samples' upper left corners, for `mean_inverse_depth`.
    """

    def __init__(self, shape: tuple[int, int], intrinsics: Intrinsics, mask: np.ndarray, columns: int) -> None:
        """Lay the grid over a picture of (height, width) [px] with its vehicle mask."""
        height, width = shape
        self.stride = max(1, round(width / columns))
        self.offset, self.intrinsics = self.stride // 2, intrinsics
        fx, fy, cx, cy = intrinsics
        u, v = np.arange(self.offset, width, self.stride), np.arange(self.offset, height, self.stride)
        self.shape = (len(v), len(u))
        x, y = np.meshgrid((u - cx) / fx, (v - cy) / fy)
        self.design = np.column_stack((x.ravel(), y.ravel(), np.ones(x.size)))
        self.corners = self.design - (0.5 / fx, 0.5 / fy, 0.0)
        self.pixels = along, across = np.meshgrid(u, v)
        self._places = np.stack((along, across), axis=2).astype(np.int16)
        self.free = self.sample(mask) == 0

    @cached_property
    def spread(self) -> np.ndarray:
        """Flat places of evenly spread samples that nothing hides, (n,)."""
        places = np.flatnonzero(self.free)
        return places[:: max(1, len(places) // _SPREAD)]

    def sample(self, picture: np.ndarray) -> np.ndarray:
        """Values of a picture at the samples, (rows, columns, ...)."""
        if picture.dtype in _FAST:  # three times as fast as numpy's strides
            return cv2.remap(picture, self._places, _WHOLE, cv2.INTER_NEAREST)
        return picture[self.offset :: self.stride, self.offset :: self.stride]

    def read(self, frame: RgbdFrame, config: PlaneConfig) -> Samples:
        """A picture at the samples."""
        return Samples(self, frame.rgb, self.sample(frame.rgb), self.inverse_depth(frame.depth, config))

    def inverse_depth(self, depth: np.ndarray, config: PlaneConfig) -> np.ndarray:
        """1/Z at the samples [1/m], 0 where the depth is absent, not finite or out of range, (rows, columns)."""
        z = np.asarray(self.sample(depth), np.float32).astype(float)
        usable = (z > config.distance_min_m) & (z < config.distance_max_m)
        return np.divide(1.0, z, out=np.zeros(z.shape), where=usable)

    def mean_inverse_depth(self, depth: np.ndarray, config: PlaneConfig) -> np.ndarray:
        """1/Z of the mean depth of the four pixels around the upper left corner of each sample, else as above.

        A pixel without a reading pulls the mean far off the surface.
        """
        depth = np.require(depth, np.float32, ("C", "W"))  # the one type of the kernel
        return _mean_inverse(depth, self._places, float(config.distance_min_m), float(config.distance_max_m))

    def cells_at(self, u: ArrayLike, v: ArrayLike) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Rows and columns of the samples nearest to pixels, the border's beyond the grid, and which pixels are not."""
        rows, columns = self.shape
        row, column = (np.rint((np.asarray(at, float) - self.offset) / self.stride).astype(np.intp) for at in (v, u))
        inside = (row >= 0) & (row < rows) & (column >= 0) & (column < columns)
        return np.minimum(np.maximum(row, 0), rows - 1), np.minimum(np.maximum(column, 0), columns - 1), inside

    def window(self, cell: tuple[int, int], radius: int) -> tuple[slice, slice]:
        """Slices of the square window around a cell, cut at the border of the grid."""
        rows, columns = (slice(max(at - radius, 0), max(at + radius + 1, 0)) for at in cell)
        return rows, columns

    def windows(self, cells: list[tuple[int, int]], radius: int) -> np.ndarray:
        """Flat places of the windows around cells, those beyond the border moved to it, (n, (2 radius + 1)^2)."""
        steps = np.arange(-radius, radius + 1)
        row, column = np.array(cells).T[:, :, None]
        rows = np.minimum(np.maximum(row + steps, 0), self.shape[0] - 1)
        columns = np.minimum(np.maximum(column + steps, 0), self.shape[1] - 1)
        return (rows[:, :, None] * self.shape[1] + columns[:, None]).reshape(len(cells), -1)


@dataclass(frozen=True)
class Samples:
    """One picture, read at the samples of a grid."""

    grid: CoarseGrid  # where the samples lie
    rgb: np.ndarray  # the picture, uint8 (H, W, 3)
    colors: np.ndarray  # its colours, uint8 (rows, columns, 3)
    inverse: np.ndarray  # 1/Z [1/m], 0 where absent or out of range, (rows, columns)


@kernel("f8[:, ::1](f4[:, ::1], i2[:, :, ::1], f8, f8)")
def _mean_inverse(depth: np.ndarray, places: np.ndarray, nearest: float, farthest: float) -> np.ndarray:
    """1/Z of the mean depth around the upper left corners of places (rows, columns, 2), 0 where out of range."""
    (rows, columns, _), quarter = places.shape, np.float32(0.25)
    inverse = np.empty((rows, columns))
    for i in range(rows):
        for j in range(columns):
            right, below = np.int64(places[i, j, 0]), np.int64(places[i, j, 1])
            left, above = max(right - 1, 0), max(below - 1, 0)
            mean = quarter * depth[above, left] + quarter * depth[above, right]
            z = np.float64(mean + quarter * depth[below, left] + quarter * depth[below, right])
            inverse[i, j] = 1.0 / z if nearest < z < farthest else 0.0
    return inverse
