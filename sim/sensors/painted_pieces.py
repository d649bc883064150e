"""The longest visible piece of every painted edge: within the picture, not behind arm or brush, not painted over."""

from __future__ import annotations

import itertools

import numpy as np

from sim.sensors.edge_view import CORNER, NEAR_M, PER_METRE
from sim.world.painted_edges import BIN_M, PaintedEdges

#: Row, and (along, up) of the left and of the right end of the least-squares line through the piece [m].
Piece = tuple[int, float, float, float, float]


class PaintedPieces:
    """The pieces of painted edges in a camera's picture.

    Args:
        edges: The painted edges.
        board: View of the board (`sim.sensors.edge_view.board_view`), read at every call.
        intrinsics: (fx, fy, cx, cy) [px].
        hidden: Where arm or brush hide the board, uint8 (H, W), 0 where they do not.
    """

    def __init__(
        self,
        edges: PaintedEdges,
        board: np.ndarray,
        intrinsics: tuple[float, float, float, float],
        hidden: np.ndarray,
    ) -> None:
        self._edges, self._hidden = edges, hidden
        self._corner, self._along, self._up = board[CORNER], *board[PER_METRE].reshape(2, 3)
        self._focal, self._centre = np.array(intrinsics[:2]), np.array(intrinsics[2:])
        height, width = hidden.shape
        self._last_pixel = np.array((width - 1.0, height - 1.0))

    def seen(self, first_m: float, last_m: float) -> list[Piece]:
        """The piece of every row of which two points at least are seen.

        Args:
            first_m: Points farther left along the board than this are not in the picture [m].
            last_m: Likewise farther right.
        """
        rows, points = self._edges.all_exposed(first_m, last_m)
        along, up = points[:, :1], points[:, 1:]
        seen = self._unhidden(self._corner + (along * self._along + up * self._up))
        pieces = []
        for row, place in _by_row(rows[seen], seen):
            piece = _longest_run(place, points[:, 0])
            if len(piece) > 1:
                pieces.append((row, *fitted_ends(points[piece])))
        return pieces

    def _unhidden(self, spots: np.ndarray) -> np.ndarray:
        """Indices of the points in camera coordinates that are in the picture and not behind arm or brush."""
        depth = spots[:, 2:]
        pixels = spots[:, :2] * self._focal
        pixels /= np.maximum(depth, NEAR_M)  # nearer ones are refused below
        pixels += self._centre
        inside = (pixels >= 0.0) & (pixels <= self._last_pixel)
        places = (inside[:, 0] & inside[:, 1] & (depth[:, 0] > NEAR_M)).nonzero()[0]
        column, row = np.rint(pixels[places]).astype(int).T
        return places[self._hidden[row, column] == 0]


def fitted_ends(points: np.ndarray) -> tuple[float, float, float, float]:
    """Least-squares line up(along) through points (n, 2), as (along, up) of its two ends."""
    along, up = points.T
    middle, height = _total(along) / len(along), _total(up) / len(up)
    away = along - middle
    slope = _total(away * up) / _total(away * away)
    first, last = along.item(0), along.item(-1)
    return first, height + slope * (first - middle), last, height + slope * (last - middle)


def _total(numbers: np.ndarray) -> float:
    """Sum in the order of the numbers; np.sum adds in pairs, which rounds differently between processors."""
    return np.add.accumulate(numbers).item(-1)


def _by_row(rows: np.ndarray, places: np.ndarray) -> list[tuple[int, np.ndarray]]:
    """Every row that occurs, in order, and its part of the places."""
    ends = [*((rows[1:] != rows[:-1]).nonzero()[0] + 1).tolist(), len(rows)] if len(rows) else []
    starts = [0, *ends[:-1]]
    return [(int(rows[start]), places[start:end]) for start, end in zip(starts, ends, strict=False)]


def _longest_run(seen: np.ndarray, along: np.ndarray) -> np.ndarray:
    """The longest run of indices whose points follow one another without a gap along the board."""
    if len(seen) == 0 or along[seen[-1]] - along[seen[0]] < (len(seen) - 0.5) * BIN_M:
        return seen
    where = along[seen]
    breaks = np.flatnonzero(where[1:] - where[:-1] > 1.5 * BIN_M) + 1
    bounds = [0, *breaks.tolist(), len(seen)]
    start, end = max(itertools.pairwise(bounds), key=lambda run: run[1] - run[0])
    return seen[start:end]
