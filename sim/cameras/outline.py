"""The outline of a convex board in the picture, taken apart into the straight lines that cut the view."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

#: Pixels on either side of the rim that are drawn with their exact share, and widest depth hole beyond it [px].
_BAND_PX, _HOLE_PX = 1, 4
#: How near to a line a pixel counts as touched by it [px].
_SLACK_PX = 3.0
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
        box: (row, row end, column, column end) around what of it no earlier line has cut away, and the rim.
        shape: (height, width) of the picture.
    """

    normal: np.ndarray
    offset: float
    start: np.ndarray
    stop: np.ndarray
    beyond: np.ndarray
    box: tuple[int, int, int, int]
    shape: tuple[int, int]

    def _band(self, low: int, high: int, margin: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Rows and columns from ``low`` to ``high`` steps across the edge, its steps, and places along it.

        The edge is walked pixel by pixel along its longer direction, up to ``margin`` past its ends.
        """
        across = int(self.flat)
        along = 1 - across
        first, last = sorted((self.start[along], self.stop[along]))
        limit = self.shape[1] if across else self.shape[0]
        places = np.arange(max(0, math.ceil(first - margin)), min(limit, math.floor(last + margin) + 1))
        middle = -(self.normal[along] * places + self.offset) / self.normal[across]
        steps = np.arange(low, high + 1)[:, None]
        other = np.floor(middle).astype(np.intp) + (steps if self.normal[across] > 0 else -steps)
        rows, columns = (other, places) if across else (places, other)
        return rows, columns, steps, places

    @property
    def flat(self) -> bool:
        """Whether the edge runs more across the picture than up it."""
        return abs(self.normal[1]) >= abs(self.normal[0])

    def rim(self) -> tuple[np.ndarray, np.ndarray]:
        """Flat indices of the pixels near the line, and the share of each that the board covers in 256ths, (n,).

        Places outside the picture are moved to its border: the share is computed for where they then are.
        """
        rows, columns, _, _ = self._band(-_BAND_PX, _BAND_PX + 1, _ALL_ALONG_PX)
        rows = np.clip(rows, 0, self.shape[0] - 1)
        columns = np.clip(columns, 0, self.shape[1] - 1)
        distance = self.normal[0] * columns + self.normal[1] * rows + (self.offset + 0.5)
        share = (np.clip(distance, 0.0, 1.0) * 256.0 + 0.5).astype(np.uint16)
        return (rows * self.shape[1] + columns).ravel(), share.ravel()

    def holes(self, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
        """Rows and columns of pixels beyond the edge that give no depth, ragged at random."""
        rows, columns, steps, places = self._band(-_HOLE_PX, 1, 0.0)
        widths = rng.integers(1, _HOLE_PX + 1, max(self.shape) // _HOLE_STEP_PX + 1)
        other, limit = (rows, self.shape[0]) if self.flat else (columns, self.shape[1])
        taken = (-steps <= widths[places // _HOLE_STEP_PX]) & (other >= 0) & (other < limit)
        chosen, place = other[taken], np.broadcast_to(places, taken.shape)[taken]
        return (chosen, place) if self.flat else (place, chosen)


def clip_polygon(polygon: np.ndarray, normal: np.ndarray, offset: float) -> np.ndarray:
    """The part of a convex polygon (n, 2) where normal . p + offset >= 0; plain floats, as there are four corners."""
    nx, ny = float(normal[0]), float(normal[1])
    points = polygon.tolist()
    kept: list[tuple[float, float]] = []
    for k, (x1, y1) in enumerate(points):
        x0, y0 = points[k - 1]
        before, value = nx * x0 + ny * y0 + offset, nx * x1 + ny * y1 + offset
        if (before >= 0.0) != (value >= 0.0):
            part = before / (before - value)
            kept.append((x0 + part * (x1 - x0), y0 + part * (y1 - y0)))
        if value >= 0.0:
            kept.append((x1, y1))
    return np.array(kept).reshape(-1, 2)


def _box(polygon: np.ndarray, width: int, height: int, margin: int) -> tuple[int, int, int, int]:
    low = np.floor(polygon.min(axis=0)).astype(int) - margin
    high = np.ceil(polygon.max(axis=0)).astype(int) + margin + 1
    return max(0, int(low[1])), min(height, int(high[1])), max(0, int(low[0])), min(width, int(high[0]))


def cut_lines(polygon: np.ndarray, width: int, height: int) -> tuple[list[CutLine], tuple[int, int, int, int] | None]:
    """Lines of a convex outline that cut the picture, and the box of the board in view.

    Args:
        polygon: Outline in the picture [px], (n, 2), any orientation; empty if the board is behind the camera, and
            then one line cuts everything away.
        width: Picture width [px].
        height: Picture height [px].

    Returns:
        The cutting lines, and (row, row end, column, column end) around the visible board or None. A board wholly
        out of view is cut away by one of its lines.
    """
    picture = np.array([[-1.0, -1.0], [width, -1.0], [width, height], [-1.0, height]])
    if len(polygon) < 3:
        everything = (0, height, 0, width)
        far, start = np.array([0.0, 1.0]), picture[0]
        return [CutLine(far, -2.0 * height, start, start, picture, everything, (height, width))], None
    board, left, cuts = picture, picture, []
    points = polygon.tolist()
    middle_u, middle_v = polygon.mean(axis=0).tolist()
    for k, (u, v) in enumerate(points):
        next_u, next_v = points[(k + 1) % len(points)]
        length = math.hypot(next_u - u, next_v - v)
        nu, nv = (v - next_v) / length, (next_u - u) / length
        if nu * (middle_u - u) + nv * (middle_v - v) < 0.0:
            nu, nv = -nu, -nv
        offset = -nu * u - nv * v
        lowest = offset + min(-nu, nu * width) + min(-nv, nv * height)
        if lowest >= _SLACK_PX:  # the whole picture lies on the board's side
            continue
        normal = np.array([nu, nv])
        board = clip_polygon(board, normal, offset)
        # What an earlier line has cut away needs no second wall; the slack keeps its rim.
        area = clip_polygon(left, -normal, _SLACK_PX - offset)
        if len(area) == 0:
            continue
        left = clip_polygon(left, normal, offset + _SLACK_PX)
        beyond = clip_polygon(picture, -normal, -offset)
        box = _box(area, width, height, _BAND_PX + 1)
        stop = np.array([next_u, next_v])
        cuts.append(CutLine(normal, offset, polygon[k], stop, beyond, box, (height, width)))
    return cuts, _box(board, width, height, _BAND_PX + 1) if len(board) >= 3 else None
