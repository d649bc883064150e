"""The outline of a convex board in the picture, taken apart into the straight lines that cut the view."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

#: Half width of the band in which the rim is antialiased, and widest depth hole beyond the rim [px].
_BAND_PX, _HOLE_PX = 2, 4
#: More than any picture measures [px].
_ALL_ALONG_PX = 1e5
#: Length over which the width of the depth holes changes [px].
_HOLE_STEP_PX = 6


@dataclass(frozen=True)
class CutLine:
    """One edge of the outline: s(u, v) = normal . (u, v) + offset is the distance to it [px], > 0 on the board.

    Attributes:
        normal: Unit normal towards the board, (2,).
        offset: Its distance term [px].
        start: First end of the edge [px], (2,).
        stop: Other end [px], (2,).
        beyond: Part of the picture beyond the line, polygon (n, 2) [px].
        box: (row, row end, column, column end) around that part and the rim.
        shape: (height, width) of the picture.
    """

    normal: np.ndarray
    offset: float
    start: np.ndarray
    stop: np.ndarray
    beyond: np.ndarray
    box: tuple[int, int, int, int]
    shape: tuple[int, int]

    def _band(self, low: int, high: int, margin: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Pixels from ``low`` to ``high`` steps across the edge, and the steps; along it up to ``margin`` further."""
        across = int(abs(self.normal[1]) >= abs(self.normal[0]))  # 1: a flat edge, walk along the columns
        along = 1 - across
        first, last = sorted((self.start[along], self.stop[along]))
        limit = self.shape[1] if across else self.shape[0]
        places = np.arange(max(0, math.ceil(first - margin)), min(limit, math.floor(last + margin) + 1))
        middle = -(self.normal[along] * places + self.offset) / self.normal[across]
        sign = 1 if self.normal[across] > 0 else -1
        steps = np.arange(low, high + 1)
        other = np.floor(middle).astype(np.intp)[:, None] + sign * steps
        places = np.broadcast_to(places[:, None], other.shape)
        inside = (other >= 0) & (other < (self.shape[0] if across else self.shape[1]))
        rows, columns = (other, places) if across else (places, other)
        return rows[inside], columns[inside], np.broadcast_to(steps, other.shape)[inside]

    def rim(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Rows and columns of the pixels near the line, and the share of each that the board covers, (n,)."""
        rows, columns, _ = self._band(-_BAND_PX, _BAND_PX + 1, _ALL_ALONG_PX)
        distance = self.normal[0] * columns + self.normal[1] * rows + self.offset
        return rows, columns, np.clip(distance + 0.5, 0.0, 1.0).astype(np.float32)

    def holes(self, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
        """Rows and columns of pixels beyond the edge that give no depth, ragged at random."""
        rows, columns, steps = self._band(-_HOLE_PX, 1, 0.0)
        along = columns if abs(self.normal[1]) >= abs(self.normal[0]) else rows
        widths = rng.integers(1, _HOLE_PX + 1, max(self.shape) // _HOLE_STEP_PX + 1)
        taken = -steps <= widths[along // _HOLE_STEP_PX]
        return rows[taken], columns[taken]


def clip_rectangle(polygon: np.ndarray, normal: np.ndarray, offset: float) -> np.ndarray:
    """The part of a convex polygon (n, 2) where normal . p + offset >= 0."""
    value = polygon @ normal + offset
    kept = []
    for k in range(len(polygon)):
        j = (k + 1) % len(polygon)
        if value[k] >= 0.0:
            kept.append(polygon[k])
        if (value[k] >= 0.0) != (value[j] >= 0.0):
            kept.append(polygon[k] + value[k] / (value[k] - value[j]) * (polygon[j] - polygon[k]))
    return np.array(kept).reshape(-1, 2)


def _box(polygon: np.ndarray, width: int, height: int, margin: int) -> tuple[int, int, int, int]:
    low = np.floor(polygon.min(axis=0)).astype(int) - margin
    high = np.ceil(polygon.max(axis=0)).astype(int) + margin + 1
    return max(0, int(low[1])), min(height, int(high[1])), max(0, int(low[0])), min(width, int(high[0]))


def cut_lines(
    polygon: np.ndarray, width: int, height: int
) -> tuple[list[CutLine], tuple[int, int, int, int] | None]:
    """Lines of a convex outline that cut the picture, and the box of the board in view.

    Args:
        polygon: Outline in the picture [px], (n, 2), any orientation; empty if the board is behind the camera.
        width: Picture width [px].
        height: Picture height [px].

    Returns:
        The cutting lines, and (row, row end, column, column end) around the visible board or None. A board wholly
        out of view is cut away by one of its lines.
    """
    picture = np.array([[-1.0, -1.0], [width, -1.0], [width, height], [-1.0, height]])
    board, cuts = picture, []
    middle = polygon.mean(axis=0)
    for start, stop in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
        edge = stop - start
        normal = np.array([-edge[1], edge[0]]) / math.hypot(*edge)
        if normal @ (middle - start) < 0.0:
            normal = -normal
        offset = -float(normal @ start)
        beyond = clip_rectangle(picture, -normal, -offset)
        board = clip_rectangle(board, normal, offset) if len(board) else board
        if len(clip_rectangle(picture, -normal, 1.0 - offset)) == 0:
            continue
        area = beyond if len(beyond) else clip_rectangle(picture, -normal, 1.0 - offset)
        box = _box(area, width, height, _BAND_PX + 1)
        cuts.append(CutLine(normal, offset, start, stop, beyond, box, (height, width)))
    return cuts, _box(board, width, height, _BAND_PX + 1) if len(board) >= 3 else None
