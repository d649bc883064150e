"""The longest visible piece of every painted edge: within the picture, not behind arm or brush, not painted over."""

from __future__ import annotations

import itertools

import numpy as np

from sim.sensors.edge_view import CORNER, NEAR_M, PER_METRE
from sim.world.painted_edges import BIN_M, PaintedEdges

#: A point this far outside a painted edge lies on the unpainted surface [m].
_OUTSIDE_M = 0.02
#: Stroke, and board coordinates (along, up) of three points: the ends of the least-squares line through the piece and a
#: point on the unpainted surface beside it [m], (6,).
Piece = tuple[int, np.ndarray]


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

    def seen(self) -> list[Piece]:
        """The piece of every stroke of which two points at least are seen."""
        strokes, points = self._edges.exposed()
        if len(strokes) == 0:
            return []
        on_board = self._edges.on_board(points)
        along, up = on_board[:, :1], on_board[:, 1:]
        seen = self._unhidden(self._corner + (along * self._along + up * self._up))
        pieces = []
        for stroke, place in _by_stroke(strokes[seen], seen):
            piece = _longest_run(place, points[:, 0])
            if len(piece) > 1:
                u0, v0, u1, v1 = fitted_ends(points[piece])
                beside = 0.5 * (u0 + u1), 0.5 * (v0 + v1) + _OUTSIDE_M
                pieces.append((stroke, self._edges.on_board(np.array(((u0, v0), (u1, v1), beside))).reshape(-1)))
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
    """Least-squares line v(u) through points (n, 2), as (u, v) of its two ends."""
    u, v = points.T
    middle, height = _total(u) / len(u), _total(v) / len(v)
    away = u - middle
    slope = _total(away * v) / _total(away * away)
    first, last = u.item(0), u.item(-1)
    return first, height + slope * (first - middle), last, height + slope * (last - middle)


def _total(numbers: np.ndarray) -> float:
    """Sum in the order of the numbers; np.sum adds in pairs, which rounds differently between processors."""
    return np.add.accumulate(numbers).item(-1)


def _by_stroke(strokes: np.ndarray, places: np.ndarray) -> list[tuple[int, np.ndarray]]:
    """Every stroke that occurs, in order, and its part of the places."""
    ends = [*((strokes[1:] != strokes[:-1]).nonzero()[0] + 1).tolist(), len(strokes)] if len(strokes) else []
    starts = [0, *ends[:-1]]
    return [(int(strokes[start]), places[start:end]) for start, end in zip(starts, ends, strict=False)]


def _longest_run(seen: np.ndarray, u: np.ndarray) -> np.ndarray:
    """The longest run of indices whose points follow one another without a gap along the stroke."""
    if len(seen) == 0 or u[seen[-1]] - u[seen[0]] < (len(seen) - 0.5) * BIN_M:
        return seen
    where = u[seen]
    breaks = np.flatnonzero(where[1:] - where[:-1] > 1.5 * BIN_M) + 1
    bounds = [0, *breaks.tolist(), len(seen)]
    start, end = max(itertools.pairwise(bounds), key=lambda run: run[1] - run[0])
    return seen[start:end]
