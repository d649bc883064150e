"""The coarse grid on which depth and colour are read: a few thousand samples stand for the whole picture."""

from __future__ import annotations

import functools
from typing import Any

import cv2
import numpy as np

from ibvs_qp.vision.kernels.samples import sample_depths
from ibvs_qp.vision.picture.mask import Intrinsics

#: Whole pixels need no table of fractions.
_WHOLE = np.empty((0, 0), np.uint16)
#: Types that OpenCV can read at places.
_FAST = (np.dtype(np.uint8), np.dtype(np.float32))
#: Sets of windows that are remembered.
_REMEMBERED = 32


class CoarseGrid:
    """Sample places of one picture size and camera.

    Attributes:
        stride: Distance of samples [px].
        shape: (rows, columns) of the grid.
        free: Samples the vehicle does not hide, bool (rows, columns).
        places: (u, v) of the samples [px], int16 (rows, columns, 2).
        pixels: The same, columns and rows apart, (rows, columns) each.
        axes: Normalised x and y of the samples, (rows, columns) each.
        design: Columns x, y, 1 in normalised coordinates, (rows * columns, 3).
    """

    def __init__(self, shape: tuple[int, int], intrinsics: Intrinsics, mask: np.ndarray, columns: int) -> None:
        """Lay the grid over a picture of (height, width) [px] with its vehicle mask."""
        height, width = shape
        self.stride = max(1, round(width / columns))
        self.offset, self._width = self.stride // 2, width
        self.intrinsics = intrinsics
        fx, fy, cx, cy = intrinsics
        u, v = np.arange(self.offset, width, self.stride), np.arange(self.offset, height, self.stride)
        self.shape = (len(v), len(u))
        self.axes = x, y = np.meshgrid((u - cx) / fx, (v - cy) / fy)
        self.design = np.column_stack((x.ravel(), y.ravel(), np.ones(x.size)))
        along, across = np.meshgrid(u, v)
        self.places = np.stack((along, across), axis=2).astype(np.int16)
        self.pixels = along, across
        self.free = self.sample(mask) == 0
        self._remember()

    def _remember(self) -> None:
        self._some = functools.lru_cache(maxsize=1)(self._make_some)
        self._windows = functools.lru_cache(maxsize=_REMEMBERED)(self._make_windows)

    def __getstate__(self) -> dict[str, Any]:
        """Without what is remembered: a snapshot of a flight may be pickled."""
        return {name: value for name, value in vars(self).items() if not callable(value)}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        self._remember()

    def sample(self, picture: np.ndarray) -> np.ndarray:
        """Values of a picture at the samples, (rows, columns, ...)."""
        if picture.dtype in _FAST:  # three times as fast as numpy's strides
            return cv2.remap(picture, self.places, _WHOLE, cv2.INTER_NEAREST)
        return picture[self.offset :: self.stride, self.offset :: self.stride]

    def inverse_depth(self, depth: np.ndarray, nearest: float, farthest: float) -> np.ndarray:
        """1/Z at the samples [1/m], 0 where the depth is absent, not finite or out of range, (rows, columns)."""
        depth = np.require(depth, np.float32, ("C", "W"))  # the one type of the kernel
        inverse = np.empty(self.shape)
        sample_depths(depth, self.places.reshape(-1, 2), float(nearest), float(farthest), inverse.reshape(-1))
        return inverse

    def cell(self, x: float, y: float) -> tuple[int, int]:
        """Row and column of the sample nearest to a normalised point (may lie outside the grid)."""
        fx, fy, cx, cy = self.intrinsics
        return round((fy * y + cy - self.offset) / self.stride), round((fx * x + cx - self.offset) / self.stride)

    def cell_at(self, u: float, v: float) -> tuple[int, int]:
        """Row and column of the sample nearest to a pixel of the picture."""
        rows, columns = self.shape
        row, column = round((v - self.offset) / self.stride), round((u - self.offset) / self.stride)
        return min(max(row, 0), rows - 1), min(max(column, 0), columns - 1)

    def window(self, cell: tuple[int, int], radius: int) -> tuple[slice, slice]:
        """Slices of the square window around a cell, cut at the border of the grid."""
        row, column = cell
        return slice(max(row - radius, 0), max(row + radius + 1, 0)), slice(
            max(column - radius, 0), max(column + radius + 1, 0)
        )

    def some(self, most: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Up to twice as many evenly spread samples that nothing hides: places in grid and picture, design."""
        return self._some(most)

    def _make_some(self, most: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        places = np.flatnonzero(self.free)
        places = np.ascontiguousarray(places[:: max(1, len(places) // most)])
        u, v = self.pixels
        return places, v.take(places) * self._width + u.take(places), self.design.take(places, axis=0)

    def windows(self, cells: list[tuple[int, int]], radius: int) -> np.ndarray:
        """Flat places of the windows around cells, those beyond the border moved to it, (n, (2 radius + 1)^2).

        Not to be written: the cells are kept for the next call.
        """
        return self._windows(tuple(cells), radius)

    def _make_windows(self, cells: tuple[tuple[int, int], ...], radius: int) -> np.ndarray:
        steps = np.arange(-radius, radius + 1)
        row, column = np.array(cells).T[:, :, None]
        rows = np.minimum(np.maximum(row + steps, 0), self.shape[0] - 1)
        columns = np.minimum(np.maximum(column + steps, 0), self.shape[1] - 1)
        return (rows[:, :, None] * self.shape[1] + columns[:, None]).reshape(len(cells), -1)
