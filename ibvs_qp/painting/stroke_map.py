"""Where a stroke was painted: v of the tip over u, as it was estimated while the stroke was laid."""

from __future__ import annotations

import copy
import math

import numpy as np

#: Length of a bin [m], and what lies before and behind the nominal stroke [m].
BIN_M, BEYOND_M = 0.01, 0.3
#: Share of a window's bins that must be painted for its mean.
_LEAST_SHARE = 0.5


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
    """v of the tip in bins of u.

    Args:
        length_m: Nominal length of the stroke [m].
    """

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
        return sum(means) / len(means) if len(means) >= _LEAST_SHARE * (high + 1 - low) else math.nan

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
        order = np.argsort(before)
        u, v = self.places()
        painted = np.isfinite(v)
        laid, stroke = u[painted] + np.interp(u[painted], before[order], (after - before)[order]), copy.copy(self)
        if laid.size:
            along, place, count = np.argsort(laid), [self._bin(float(place)) for place in laid], [0] * len(u)
            for index, bin_before in enumerate(np.flatnonzero(painted).tolist()):
                joined = index > 0 and painted[bin_before - 1]  # a hole stays one
                first, last = sorted((place[index - 1] if joined else place[index], place[index]))
                count[max(first, 0) : max(last + 1, 0)] = [1] * len(count[max(first, 0) : max(last + 1, 0)])
            stroke._count = count
            stroke._sum = (np.array(count) * np.interp(u, laid[along], v[painted][along])).tolist()
        return stroke

    def widened(self, again: StrokeMap) -> StrokeMap:
        """Outermost line of this stroke and of one painted over it: v is the larger one where both lie."""
        wide = copy.deepcopy(self)
        for place, (total, count) in enumerate(zip(again._sum, again._count, strict=True)):
            own = self._count[place]
            if count and own and total * own > self._sum[place] * count:
                wide._sum[place], wide._count[place] = total, count
        return wide

    @staticmethod
    def _bin(u: float) -> int:
        return math.floor((u + BEYOND_M) / BIN_M)
