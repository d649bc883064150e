"""The paper's bounding box: from a point on the surface outwards until the normal changes."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ibvs_qp.vision.paper.config import PaperConfig
from ibvs_qp.vision.paper.normals import NormalImage

#: Changed normals in a row that end the surface; one alone is noise.
_IN_A_ROW = 2
#: Rays that must agree on a side, as a number, and as a fraction of those that ended there.
_VOTES, _MOST = 3, 0.5
#: Fraction of readings in the seed's window, and on the surface, that must exist.
_VALID = 0.25
#: Normals in the box are averaged over a grid of about this many columns.
_COLUMNS = 80
#: Readings nearer than this are alike: the filter's window and the correlation of the camera's noise [px at 640].
_ALIKE_PX = 40.0


@dataclass(frozen=True, kw_only=True)
class SurfaceBox:
    """The surface as the search found it.

    Attributes:
        left: First column [px].
        top: First row [px].
        right: Last column [px].
        bottom: Last row [px].
        normal: Mean unit normal into the surface, in C, (3,).
        distance_m: Distance of the camera centre from the surface [m].
        normal_sigma: Standard deviation of the mean normal per axis [rad].
        distance_sigma_m: Standard deviation of the distance [m].
        inlier_share: Fraction of the readings in the box that have the surface's normal.
        residual_sigma: Spread of the readings about the plane, fraction of depth.
    """

    left: float
    top: float
    right: float
    bottom: float
    normal: np.ndarray
    distance_m: float
    normal_sigma: float
    distance_sigma_m: float
    inlier_share: float
    residual_sigma: float

    @property
    def center(self) -> tuple[float, float]:
        """Middle of the box (u, v) [px]: where the search begins in the next picture."""
        return 0.5 * (self.left + self.right), 0.5 * (self.top + self.bottom)


class BoxSearch:
    """Searches the surface's boundary along rays, all at once.

    Args:
        normals: The normal image to search in.
        visible: Where the vehicle does not hide the view, bool (rows, columns) of the normal image.
        config: Settings.
    """

    def __init__(self, normals: NormalImage, visible: np.ndarray, config: PaperConfig) -> None:
        self._normals, self._config = normals, config
        rows, columns = normals.shape
        scale = columns / 640.0
        angle = 2.0 * math.pi * np.arange(config.rays) / config.rays
        step = max(1.0, config.ray_step_px * scale)
        along = step * np.arange(1, math.ceil(math.hypot(rows, columns) / step) + 1)
        self._step, self._count = step, np.arange(len(along))
        self._cos, self._sin = np.cos(angle), np.sin(angle)
        self._columns = np.rint(self._cos[:, None] * along).astype(np.intp)
        self._rows = np.rint(self._sin[:, None] * along).astype(np.intp)
        self._offsets = self._rows * columns + self._columns
        self._limit = math.cos(math.radians(config.change_deg))
        self._seed_half = max(2, round(0.5 * config.seed_px * scale))
        self._spread = config.spread_px * scale
        self._smallest = config.smallest_px * scale
        self._visible = visible
        rim = normals.border
        self._first, self._last = rim, (rows - 1 - rim, columns - 1 - rim)

    def search(self, seed_pixel: tuple[float, float]) -> SurfaceBox | str:
        """Find the box around the surface on which a pixel lies, or return why it is missing."""
        stride = self._normals.stride
        if not (math.isfinite(seed_pixel[0]) and math.isfinite(seed_pixel[1])):
            return f"seed pixel {seed_pixel} is no place in a picture"
        column, row = round(seed_pixel[0] / stride), round(seed_pixel[1] / stride)
        rows, columns = self._normals.shape
        if not (0 <= row < rows and 0 <= column < columns):
            return f"seed pixel ({seed_pixel[0]:g}, {seed_pixel[1]:g}) lies outside the picture"
        row, column = min(max(row, self._first), self._last[0]), min(max(column, self._first), self._last[1])
        normal = self._seed_normal(row, column)
        if normal is None:
            return "no valid depth around the seed"
        left, top, right, bottom = self._extents(row, column, normal)
        if min(right - left, bottom - top) < self._smallest:
            return f"the surface around the seed is only {right - left:.0f} x {bottom - top:.0f} px"
        return self._measure(left, top, right, bottom, normal)

    def _seed_normal(self, row: int, column: int) -> np.ndarray | None:
        half, n = self._seed_half, self._normals
        place = np.s_[
            max(row - half, self._first) : min(row + half, self._last[0]) + 1 : 4,
            max(column - half, self._first) : min(column + half, self._last[1]) + 1 : 4,
        ]
        good = (n.depth[place] > 0.0) & self._visible[place]
        if np.count_nonzero(good) < max(4, _VALID * good.size):
            return None
        vector = np.array([np.median(part[place][good]) for part in (n.x, n.y, n.z)], float)
        return vector / np.linalg.norm(vector)

    def _extents(self, row: int, column: int, normal: np.ndarray) -> tuple[float, float, float, float]:
        """Left, top, right and bottom of the surface [normals]."""
        n, (_, columns) = self._normals, self._normals.shape
        place = self._offsets + (row * columns + column)
        a, b, c = (np.float32(entry) for entry in normal)
        parts = (part.reshape(-1).take(place, mode="clip") for part in (n.x, n.y, n.z))
        agreement = sum(gain * part for gain, part in zip((a, b, c), parts, strict=True))
        inside = self._count < self._leaving(row, column)[:, None]
        changed = (agreement < self._limit) & inside & self._visible.reshape(-1).take(place, mode="clip")
        lasting = changed[:, : 1 - _IN_A_ROW]
        for shift in range(1, _IN_A_ROW):
            lasting = lasting & changed[:, shift : changed.shape[1] - _IN_A_ROW + 1 + shift]
        ended = np.flatnonzero(lasting.any(axis=1))
        step = np.argmax(lasting[ended], axis=1)
        there = place[ended, step]
        u, v = column + self._columns[ended, step], row + self._rows[ended, step]
        # the change shows which way the boundary runs: across the picture if the normal turns up or down
        level = np.abs(n.y.ravel().take(there) - b) > np.abs(n.x.ravel().take(there) - a)
        cos, sin = self._cos[ended], self._sin[ended]
        return (
            self._side(u[~level & (cos < 0.0)], self._first),
            self._side(v[level & (sin < 0.0)], self._first),
            self._side(u[~level & (cos > 0.0)], self._last[1]),
            self._side(v[level & (sin > 0.0)], self._last[0]),
        )

    def _leaving(self, row: int, column: int) -> np.ndarray:
        """Steps that every ray from a place can take within the picture, (rays,)."""
        with np.errstate(divide="ignore"):
            across = np.where(self._cos > 0.0, self._last[1] - column, self._first - column) / self._cos
            down = np.where(self._sin > 0.0, self._last[0] - row, self._first - row) / self._sin
        return np.floor((np.fmin(across, down) - 1.0) / self._step)

    def _side(self, places: np.ndarray, border: int) -> float:
        """Where most rays of a side met the boundary, or the picture's border if too few agree."""
        if len(places) < _VOTES:
            return float(border)
        middle = float(np.median(places))
        agreed = np.abs(places - middle) <= self._spread
        count = int(np.count_nonzero(agreed))
        return float(places[agreed].mean()) if count >= max(_VOTES, _MOST * len(places)) else float(border)

    def _measure(self, left: float, top: float, right: float, bottom: float, normal: np.ndarray) -> SurfaceBox | str:
        """Mean normal and distance over the box."""
        n, stride = self._normals, self._normals.stride
        every = max(1, n.shape[1] // _COLUMNS)
        place = np.s_[int(top) : int(bottom) + 1 : every, int(left) : int(right) + 1 : every]
        x, y, z, depth = n.x[place], n.y[place], n.z[place], n.depth[place]
        good = (depth > 0.0) & self._visible[place]
        seen = int(np.count_nonzero(good))
        good &= x * float(normal[0]) + y * float(normal[1]) + z * float(normal[2]) > self._limit
        count = int(np.count_nonzero(good))
        if count < max(9, _VALID * seen):
            return "too few normals in the box agree"
        vectors = np.array([x[good], y[good], z[good]], float)
        mean = vectors.mean(axis=1)
        mean /= np.linalg.norm(mean)
        rays = np.array([n.ray_x[place][good], n.ray_y[place][good], np.ones(count)])
        reading = depth[good] * (mean @ rays)
        distance = float(np.median(reading))
        independent = max(3.0, count * (every * 640.0 / (n.shape[1] * _ALIKE_PX)) ** 2)
        spread = float(np.mean(np.std(vectors, axis=1)))
        sigma = float(np.std(reading))
        return SurfaceBox(
            left=left * stride,
            top=top * stride,
            right=right * stride,
            bottom=bottom * stride,
            normal=mean,
            distance_m=distance,
            normal_sigma=spread / math.sqrt(independent),
            distance_sigma_m=sigma / math.sqrt(independent),
            inlier_share=count / max(seen, 1),
            residual_sigma=sigma / max(distance, 1e-6),
        )
