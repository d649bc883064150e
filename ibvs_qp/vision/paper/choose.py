"""The paper's choice: the topmost level line, and the first upright one."""

from __future__ import annotations

import numpy as np

#: Segments whose middles are nearer than this across their direction are pieces of one edge [px at 640].
_ONE_EDGE_PX = 6.0


def topmost(level: np.ndarray, scale: float) -> int | None:
    """Index of the topmost of level segments (n, 2, 2) [px]; of several on that edge the longest, None for none."""
    if not len(level):
        return None
    height = level[:, :, 1].mean(axis=1)
    return _longest(level, np.flatnonzero(height <= height.min() + _ONE_EDGE_PX * scale))


def first(upright: np.ndarray, scale: float) -> int | None:
    """Index of the first upright segment, or of the longest on its edge; None for none."""
    if not len(upright):
        return None
    place = upright[:, :, 0].mean(axis=1)
    return _longest(upright, np.flatnonzero(np.abs(place - place[0]) <= _ONE_EDGE_PX * scale))


def _longest(segments: np.ndarray, among: np.ndarray) -> int:
    run = segments[among, 1] - segments[among, 0]
    return int(among[np.argmax(np.vecdot(run, run))])
