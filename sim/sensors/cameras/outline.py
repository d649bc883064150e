"""The straight lines along which the outline of a convex board cuts the picture."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

#: Margin around drawn areas, and widest depth hole beyond the rim [px].
_BAND_PX, _HOLE_PX = 1, 4
#: A line touches but the two pixels between whose centres it passes: at 45 degrees half a diagonal is 0.71 px.
_RIM_STEPS = np.array([[0], [1]])
#: How near to a line a pixel counts as touched by it [px].
_SLACK_PX = 3.0
#: A pixel so far from a line is untouched by its rim and its polygon [px].
_CLEAR_PX = 3
#: Length over which the width of the depth holes changes [px].
_HOLE_STEP_PX = 6

Box = tuple[int, int, int, int]


@dataclass(frozen=True)
class CutLine:
    """One edge of the outline: s(u, v) = normal . (u, v) + offset is the distance to it [px], > 0 on the board."""

    normal: np.ndarray  # unit normal towards the board, (2,)
    offset: float  # its distance term [px]
    start: np.ndarray  # first end of the edge [px], (2,)
    stop: np.ndarray  # other end [px], (2,)
    beyond: np.ndarray  # part of the picture beyond the line, polygon (n, 2) [px]
    # (row, row end, column, column end) around the part that no earlier line has cut away, and the rim; the line
    # changes no pixel outside
    box: Box
    shape: tuple[int, int]  # (height, width) of the picture
    flat: bool  # whether the edge runs more across the picture than up it

    def _across(self, places: np.ndarray) -> np.ndarray:
        """Position of the line across its longer direction, at whole pixels along it [px]."""
        across = int(self.flat)
        return -(self.normal[1 - across] * places + self.offset) / self.normal[across]

    def split(self) -> tuple[Box, Box]:
        """Two parts of the box: the first lies entirely beyond the line, the second contains the line."""
        r0, r1, c0, c1 = self.box
        low, high, first, last = (r0, r1, c0, c1 - 1) if self.flat else (c0, c1, r0, r1 - 1)
        one, other = self._across(np.array([first, last])).tolist()
        if self.normal[int(self.flat)] > 0:
            edge = min(max(math.floor(min(one, other)) - _CLEAR_PX, low), high)
            parts = (low, edge), (edge, high)
        else:
            edge = min(max(math.ceil(max(one, other)) + _CLEAR_PX, low), high)
            parts = (edge, high), (low, edge)
        (b0, b1), (l0, l1) = parts
        return ((b0, b1, c0, c1), (l0, l1, c0, c1)) if self.flat else ((r0, r1, b0, b1), (r0, r1, l0, l1))

    def rim(self, box: Box) -> tuple[np.ndarray, np.ndarray]:
        """Flat indices of the pixels of a box near the line, and the board's fraction of each in 256ths, uint32 (n,).

        Places outside the box are moved to its border: the fraction is computed for where they then are.
        """
        r0, r1, c0, c1 = box
        low, high, first, end = (r0, r1, c0, c1) if self.flat else (c0, c1, r0, r1)
        places = np.arange(first, end)
        other = np.floor(self._across(places)).astype(np.intp) + _RIM_STEPS
        np.maximum(other, low, out=other)
        np.minimum(other, high - 1, out=other)
        across = int(self.flat)
        distance = other * (256.0 * self.normal[across])
        distance += places * (256.0 * self.normal[1 - across]) + (256.0 * (self.offset + 0.5) + 0.5)
        np.maximum(distance, 0.0, out=distance)
        np.minimum(distance, 256.0, out=distance)
        width = self.shape[1]
        indices = other * width + places if self.flat else other + places * width
        return indices.ravel(), distance.astype(np.uint32).ravel()

    def holes(self, rng: np.random.Generator, beyond_px: int = 0) -> np.ndarray:
        """Flat indices of pixels beyond the edge that give no depth, ragged at random, (n,).

        Args:
            rng: Raggedness.
            beyond_px: By how much the board has grown beyond the edge.
        """
        limit = self.shape[1 - int(self.flat)]
        along = 1 - int(self.flat)
        first, last = sorted((float(self.start[along]), float(self.stop[along])))
        first, last = math.ceil(first) - beyond_px, math.floor(last) + beyond_px
        first, end = max(0, first), min(self.shape[int(self.flat)], last + 1)
        places = np.arange(first, max(first, end))
        towards = 1 if self.normal[int(self.flat)] > 0 else -1  # the board
        widths = rng.integers(1, _HOLE_PX + 1, max(self.shape) // _HOLE_STEP_PX + 1)
        steps = np.arange(-_HOLE_PX, 2)[:, None]
        taken = -steps <= widths[places // _HOLE_STEP_PX]
        other = np.floor(self._across(places)).astype(np.intp) + (steps - beyond_px) * towards
        if len(places) and (other[[0, -1]].min() < 0 or other[[0, -1]].max() >= limit):
            taken &= (other >= 0) & (other < limit)
        stride, step = (self.shape[1], 1) if self.flat else (1, self.shape[1])
        other *= stride
        other += places * step
        return other[taken]


def clip_polygon(polygon: np.ndarray, normal: np.ndarray, offset: float) -> np.ndarray:
    """The part of a convex polygon (n, 2) where normal . p + offset >= 0; plain floats, as there are four corners."""
    nx, ny = float(normal[0]), float(normal[1])
    points = polygon.tolist()
    inside: list[tuple[float, float]] = []
    for k, (x1, y1) in enumerate(points):
        x0, y0 = points[k - 1]
        before, value = nx * x0 + ny * y0 + offset, nx * x1 + ny * y1 + offset
        if (before >= 0.0) != (value >= 0.0):
            part = before / (before - value)
            inside.append((x0 + part * (x1 - x0), y0 + part * (y1 - y0)))
        if value >= 0.0:
            inside.append((x1, y1))
    return np.array(inside).reshape(-1, 2)


def _box(polygon: np.ndarray, width: int, height: int, margin: int) -> Box:
    low = np.floor(polygon.min(axis=0)).astype(int) - margin
    high = np.ceil(polygon.max(axis=0)).astype(int) + margin + 1
    return max(0, int(low[1])), min(height, int(high[1])), max(0, int(low[0])), min(width, int(high[0]))


def cut_lines(polygon: np.ndarray, width: int, height: int) -> tuple[list[CutLine], Box | None]:
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
        return [CutLine(far, -2.0 * height, start, start, picture, everything, (height, width), True)], None
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
        # The part that an earlier line has cut away is wall already; the slack preserves its rim.
        area = clip_polygon(left, -normal, _SLACK_PX - offset)
        if len(area) == 0:
            continue
        left = clip_polygon(left, normal, offset + _SLACK_PX)
        beyond = clip_polygon(picture, -normal, -offset)
        box = _box(area, width, height, _BAND_PX + 1)
        stop = np.array([next_u, next_v])
        flat = abs(nv) >= abs(nu)
        cuts.append(CutLine(normal, offset, polygon[k], stop, beyond, box, (height, width), flat))
    return cuts, _box(board, width, height, _BAND_PX + 1) if len(board) >= 3 else None
