"""Segments cut off where the surface ends: a joint of the wall may run on where an edge of the surface stops."""

from __future__ import annotations

import cv2
import numpy as np

from ibvs_qp.vision.kernels.beside import cells_beside
from ibvs_qp.vision.surface.region import SurfaceRegion, filled

#: Distance from a segment at which the surface's samples must lie beside it [cells], and places looked at along it.
_CELLS_BESIDE, _PLACES = 1.5, 48
#: A segment beside which the surface lies for more than this share of its length stays whole.
_WHOLE = 0.95


def trimmed(segments: np.ndarray, surface: SurfaceRegion, shortest_px: float) -> np.ndarray:
    """The pieces beside the surface of those segments that reach beyond it.

    The search for segments joins an edge of the surface and a joint of the wall that prolongs it a pixel or two
    aside; a fit to both is wrong by a part of that.

    Args:
        segments: End points (u1, v1, u2, v2) [px], (n, 4).
        surface: The surface.
        shortest_px: Shorter pieces are left out [px].

    Returns:
        End points, one piece for every segment that is cut at most, (m, 4) [px].
    """
    grid, ends = surface.grid, segments.reshape(-1, 2, 2)
    region = cv2.morphologyEx(filled(surface.colored), cv2.MORPH_OPEN, np.ones((3, 3), np.uint8))
    run = ends[:, 1] - ends[:, 0]
    length = np.hypot(*run.T)
    sides = np.empty((len(segments), 2, _PLACES), np.uint8)
    cells_beside(region, segments, _CELLS_BESIDE * grid.stride, float(grid.stride), float(grid.offset), sides)
    marked = sides.sum(axis=2)
    beside = np.where((marked[:, 0] >= marked[:, 1])[:, None], sides[:, 0], sides[:, 1]) > 0
    first, count = _longest_runs(beside)
    kept = (count < _WHOLE * _PLACES) & (count * length >= shortest_px * _PLACES)
    start, end = ((edge / _PLACES)[:, None] * run + ends[:, 0] for edge in (first, first + count))
    return np.hstack((start, end))[kept]


def _longest_runs(marks: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """First place and number of places of the longest run in every row of bool (n, K), (n,) each."""
    place = np.arange(marks.shape[1])
    length = place - np.maximum.accumulate(np.where(marks, -1, place), axis=1)  # since the last unmarked place
    last = np.argmax(length, axis=1)
    count = length[np.arange(len(marks)), last]
    return last + 1 - count, count
