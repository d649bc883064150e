"""Where the strokes were painted: v of the tip over u, as it was estimated while they were laid."""

from __future__ import annotations

import copy
import math

import numpy as np

#: Length of a bin [m], and length before and behind the nominal stroke [m].
BIN_M, BEYOND_M = 0.01, 0.3
#: Part of a window's bins that must be painted for its mean [-].
LEAST_PAINTED = 0.5


def band_edge(u: np.ndarray, v: np.ndarray, radius: float, side: int) -> np.ndarray:
    r"""Edge of the band that a round brush leaves along a line, less its radius.

    .. math:: \pm \max_j \left( \pm v_j + \sqrt{r^2 - (u_k - u_j)^2} \right) \mp r

    A narrow dip of the line is filled by the brush on both sides of it.

    Args:
        u: Places along the line, increasing [m], (n,).
        v: Places across it [m], (n,).
        radius: Of the brush r [m].
        side: +1 for the edge at larger v, -1 for the other one.

    Returns:
        v [m], (n,).
    """
    line = side * v
    edge = line.copy()
    for apart in range(1, u.size):
        way = u[apart:] - u[:-apart]
        if way.min() >= radius:
            break
        lower = np.where(way < radius, radius - np.sqrt(np.maximum(radius**2 - way**2, 0.0)), math.inf)
        edge[apart:] = np.maximum(edge[apart:], line[:-apart] - lower)
        edge[:-apart] = np.maximum(edge[:-apart], line[apart:] - lower)
    return side * edge


class StrokeMap:
    """v of the tip in bins of u along a stroke of that nominal length [m]."""

    def __init__(self, length_m: float) -> None:
        bins = math.ceil((length_m + 2.0 * BEYOND_M) / BIN_M)
        self._sum, self._count = [0.0] * bins, [0] * bins

    def add(self, u: float, v: float) -> None:
        """The tip paints here."""
        place = self._bin(u)
        if 0 <= place < len(self._sum):
            self._sum[place] += v
            self._count[place] += 1

    def mean(self, first_u: float, last_u: float) -> float:
        """Mean v between two places [m]; NaN where the stroke does not cover half of the way."""
        low, high = sorted((self._bin(first_u), self._bin(last_u)))
        window = range(max(low, 0), min(high + 1, len(self._sum)))
        means = [self._sum[k] / self._count[k] for k in window if self._count[k]]
        return sum(means) / len(means) if len(means) >= LEAST_PAINTED * (high + 1 - low) else math.nan

    def places(self) -> tuple[np.ndarray, np.ndarray]:
        """Middle of every bin along u and its mean v [m], (bins,) each; NaN where nothing is painted."""
        count = np.array(self._count, float)
        u = BIN_M * (np.arange(count.size) + 0.5) - BEYOND_M
        return u, np.divide(self._sum, count, out=np.full(count.size, math.nan), where=count > 0.0)

    def moved(self, before: np.ndarray, after: np.ndarray) -> StrokeMap:
        """The same stroke where its places along u turn out to be others; one mean is left in every bin.

        Args:
            before: Places as they were when the stroke was laid [m], (n,).
            after: Where they are [m], (n,).
        """
        order, (u, v), stroke = np.argsort(before), self.places(), copy.copy(self)
        painted = np.isfinite(v)
        laid = u[painted] + np.interp(u[painted], before[order], (after - before)[order])
        if laid.size:
            along, count = np.argsort(laid), np.zeros(u.size, int)
            place = np.floor((laid + BEYOND_M) / BIN_M).astype(int)
            for index, bin_before in enumerate(np.flatnonzero(painted)):
                joined = index > 0 and painted[bin_before - 1]  # a hole stays one
                first, last = sorted((place[index - 1] if joined else place[index], place[index]))
                count[max(first, 0) : max(last + 1, 0)] = 1
            stroke._sum = (count * np.interp(u, laid[along], v[painted][along])).tolist()
            stroke._count = count.tolist()
        return stroke

    def widened(self, again: StrokeMap) -> StrokeMap:
        """Outermost line of this stroke and of one painted over it: v is the larger one where both lie.

        In a hole of this one it is that of the other.
        """
        wide = copy.deepcopy(self)
        for place, (total, count) in enumerate(zip(again._sum, again._count, strict=True)):
            own = self._count[place]
            if count and (not own or total * own > self._sum[place] * count):
                wide._sum[place], wide._count[place] = total, count
        return wide

    @staticmethod
    def _bin(u: float) -> int:
        return math.floor((u + BEYOND_M) / BIN_M)


class Strokes:
    """Maps of the strokes of a job of that length and radius of the brush [m].

    Attributes:
        complete: Outermost lines of the complete strokes, oldest first.
        passes: Over the stroke in progress, the first one first: as estimated, and on the safe side.
    """

    def __init__(self, length_m: float, radius_m: float) -> None:
        self._length, self._radius = length_m, radius_m
        self.complete: list[StrokeMap] = []
        self.passes: list[tuple[StrokeMap, StrokeMap]] = []

    def begin_pass(self) -> None:
        """A stroke, or a pass over it, begins."""
        self.passes.append((StrokeMap(self._length), StrokeMap(self._length)))

    def add(self, u: float, v: float, margin: float = 0.0) -> None:
        """The tip paints here, on the safe side farther out by a margin."""
        found, farthest_out = self.passes[-1]
        found.add(u, v)
        farthest_out.add(u, v + margin)

    def end_pass(self, before: np.ndarray, after: np.ndarray) -> None:
        """A pass ends; its paint has moved along u, as of `AlongTrack.smoothed` [m], (n,) each.

        Strokes have waves of 3 mm over 0.1 m: a map that is 20 mm off shows no gap where there is one.
        """
        *earlier, (found, farthest_out) = self.passes
        if shift := float(after[0] - before[0]):  # belongs to the passes before as well
            here, to = before[:1], before[:1] + shift
            earlier = [(one.moved(here, to), other.moved(here, to)) for one, other in earlier]
        self.passes = [*earlier, (found.moved(before, after), farthest_out.moved(before, after))]

    def end_stroke(self) -> None:
        """The stroke is complete."""
        self.complete.append(self.outermost())
        self.passes = []

    def outermost(self) -> StrokeMap:
        """Outermost line of all passes."""
        (stroke, _), *again = self.passes
        for found, _ in again:
            stroke = stroke.widened(found)
        return stroke

    def overlap(self, first_u: float, last_u: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Overlap of the stroke in progress with the last one, where both lie between two places along them [m].

        Returns:
            u, and overlap on the safe side and largest overlap of all passes, less the brush's width [m], (n,) each.
        """
        u, last = self.complete[-1].places()
        inner = np.fmin.reduce([farthest_out.places()[1] for _, farthest_out in self.passes])
        innermost = np.fmin.reduce([found.places()[1] for found, _ in self.passes])
        low, high = sorted((first_u, last_u))
        within = (low <= u) & (u <= high) & np.isfinite(last - innermost)

        def edge(v: np.ndarray, side: int) -> np.ndarray:
            painted, found = np.isfinite(v), np.full(v.size, math.nan)
            found[painted] = band_edge(u[painted], v[painted], self._radius, side)
            return found[within]

        return u[within], edge(last, 1) - edge(inner, -1), edge(last, 1) - edge(innermost, -1)
