"""Every straight line of a picture, on a surface or not: segments of a general detector, joined where collinear."""

from __future__ import annotations

import cv2
import numpy as np

#: Shortest segment that may be joined with others, and shortest line listed [px at 640].
_PIECE_PX, _LISTED_PX = 12.0, 20.0
#: Two pieces are one line if they lie this near to their common line [px at 640] and their gap is at most this
#: fraction of their lengths together.
_APART_PX, _GAP_SHARE = 1.5, 0.5
#: Largest angle between two pieces of one line [rad].
_TURN = np.radians(3.0)


def find_segments(grey: np.ndarray, scale: float) -> np.ndarray:
    """All line segments, longest first.

    The detector is OpenCV's LSD (von Gioi et al., IPOL 2012): no threshold of its own needs tuning, and on real
    pictures it misses one marked line in twenty at most; a line that it breaks into pieces is joined again.

    Args:
        grey: Picture, uint8 (H, W).
        scale: Factor for lengths stated for a picture 640 wide.

    Returns:
        End points (u1, v1, u2, v2) [px], the brighter side to the left of the way, (n, 4).
    """
    found = cv2.createLineSegmentDetector().detect(np.ascontiguousarray(grey))[0]
    pieces = np.zeros((0, 4)) if found is None else np.asarray(found, float).reshape(-1, 4)
    pieces = pieces[_lengths(pieces) >= _PIECE_PX * scale]
    lines = np.concatenate((pieces, _joined(pieces, scale)))
    lines = lines[_lengths(lines) >= _LISTED_PX * scale]
    return lines[np.argsort(-_lengths(lines), kind="stable")]


def _lengths(segments: np.ndarray) -> np.ndarray:
    return np.hypot(segments[:, 2] - segments[:, 0], segments[:, 3] - segments[:, 1])


def _joined(pieces: np.ndarray, scale: float) -> np.ndarray:
    """Lines of two pieces and more, (m, 4); pieces of one polarity only are joined, as LSD orders their ends by it."""
    order = np.argsort(-_lengths(pieces), kind="stable")
    free = np.ones(len(pieces), bool)
    lines = []
    for index in order:
        if not free[index]:
            continue
        free[index] = False
        line, grown = pieces[index], False
        while True:
            mates = np.flatnonzero(free & _continues(line, pieces, scale))
            if len(mates) == 0:
                break
            free[mates] = False
            line, grown = _through(np.vstack((line, pieces[mates]))), True
        if grown:
            lines.append(line)
    return np.array(lines).reshape(-1, 4)


def _continues(line: np.ndarray, pieces: np.ndarray, scale: float) -> np.ndarray:
    """Whether pieces lie on the line's prolongation and near enough to it, bool (n,)."""
    start, run = line[:2], line[2:] - line[:2]
    length = float(np.hypot(*run))
    direction = run / length
    normal = np.array([-direction[1], direction[0]])
    lengths = _lengths(pieces)
    parallel = (pieces[:, 2:] - pieces[:, :2]) @ direction >= np.cos(_TURN) * lengths
    ends = pieces.reshape(-1, 2, 2) - start
    near = np.abs(ends @ normal).max(axis=1) <= _APART_PX * scale
    along = ends @ direction
    gap = np.maximum(along.min(axis=1) - length, -along.max(axis=1))
    return parallel & near & (gap <= _GAP_SHARE * (lengths + length))


def _through(pieces: np.ndarray) -> np.ndarray:
    """The line through the ends of pieces, weighted by length, from the first to the last end, (4,)."""
    points, weight = pieces.reshape(-1, 2), np.repeat(_lengths(pieces), 2)
    middle = (weight[:, None] * points).sum(axis=0) / weight.sum()
    offset = points - middle
    _, axes = np.linalg.eigh((weight[:, None] * offset).T @ offset)
    direction = axes[:, 1]
    if direction @ (pieces[0, 2:] - pieces[0, :2]) < 0.0:
        direction = -direction
    along = offset @ direction
    return np.concatenate((middle + along.min() * direction, middle + along.max() * direction))
