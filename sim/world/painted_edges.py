"""True upper edge of every painted row, computed from the strokes."""

from __future__ import annotations

import math

import numpy as np

from sim.world.board import BoardGeometry
from sim.world.scene import Scene

BoardPoint = tuple[float, float] | np.ndarray

#: Length of a bin along the board [m].
BIN_M = 0.005
#: A stroke that moves less along the board than this multiple of its rise is a climb, not part of a row.
_FLATNESS = 1.0


class PaintedEdges:
    """Highest painted point along the board for every row (round brush: its centre plus its radius).

    Attributes:
        top: That height [m], -inf without paint, (rows + 1, bins); row 0 is empty.
        open: Bins that are painted and that no later row lies over, bool (rows + 1, bins).
        middles: Middle of each bin along the board [m], (bins,). `heights` and `all_exposed` update all three.

    Args:
        scene: Board and paint job.
    """

    def __init__(self, scene: Scene) -> None:
        self._first_height, self._pitch = BoardGeometry(scene).row_height(1), scene.paint.pitch_m
        self._radius, self._rows = 0.5 * scene.paint.brush_width_m, scene.paint.rows
        self._bins = math.ceil(scene.board.width_m / BIN_M)
        self.top = np.full((self._rows + 1, self._bins), -math.inf)
        # Bins of a row that a later row covers, updated by every stroke.
        self._covered = np.zeros((self._rows + 1, self._bins), dtype=bool)
        self._reach = math.ceil(self._radius / BIN_M)
        self.open = np.zeros((self._rows + 1, self._bins), dtype=bool)  # painted and not covered
        self.middles = (np.arange(self._bins) + 0.5) * BIN_M
        self._lowest, self._highest = math.inf, -math.inf
        self._coming: list[tuple[BoardPoint, BoardPoint]] = []  # strokes not yet in the tables

    def stroke(self, previous: BoardPoint | None, current: BoardPoint) -> None:
        """Record a stroke between two tip positions (along, up) [m]; see `sim.world.canvas.Canvas.stroke`."""
        if previous is not None:
            self._coming.append((previous, current))

    def _catch_up(self) -> None:
        """Add the strokes since the last call to the tables."""
        for previous, current in self._coming:
            self._add(previous, current)
        self._coming.clear()

    def _add(self, previous: BoardPoint, current: BoardPoint) -> None:
        a0, u0, a1, u1 = float(previous[0]), float(previous[1]), float(current[0]), float(current[1])
        if abs(a1 - a0) <= _FLATNESS * abs(u1 - u0):
            return
        if a0 > a1:
            a0, u0, a1, u1 = a1, u1, a0, u0
        row = round((0.5 * (u0 + u1) - self._first_height) / self._pitch) + 1
        row = min(max(row, 1), self._rows)
        top = self.top[row]
        first, last = max(0, math.floor(a0 / BIN_M)), min(self._bins - 1, math.floor(a1 / BIN_M))
        for k in range(first, last + 1):  # mostly a single bin: plain floats beat arrays
            place = min(max((k + 0.5) * BIN_M, a0), a1)
            height = u0 + (place - a0) / (a1 - a0) * (u1 - u0) + self._radius
            if height > top[k]:
                self._lowest, self._highest = min(self._lowest, height), max(self._highest, height)
                if top[k] == -math.inf:
                    over = slice(max(0, k - self._reach), k + self._reach + 1)
                    self._covered[:row, over] = True
                    self.open[:row, over] = False
                    self.open[row, k] = not self._covered[row, k]
                top[k] = height

    @property
    def heights(self) -> tuple[float, float]:
        """Lowest and highest point [m]; (inf, -inf) without paint."""
        self._catch_up()
        return self._lowest, self._highest

    def all_exposed(self, first_m: float = -math.inf, last_m: float = math.inf) -> tuple[np.ndarray, np.ndarray]:
        """Points of the rows' upper edges that no later row covers, along the board: rows (n,), (along, up) [m] (n, 2).

        Args:
            first_m: Points farther left along the board are left out [m].
            last_m: Likewise farther right.
        """
        start, end = self.bins_between(first_m, last_m)
        rows, bins = self.open[:, start:end].nonzero()
        points = np.empty((len(rows), 2))
        points[:, 0], points[:, 1] = self.middles[start:end][bins], self.top[:, start:end][rows, bins]
        return rows, points

    def bins_between(self, first_m: float, last_m: float) -> tuple[int, int]:
        """First bin and the one after the last that may hold points of `all_exposed`, arguments as there."""
        self._catch_up()
        start = 0 if first_m <= 0.0 else min(int(first_m / BIN_M), self._bins)
        return start, self._bins if last_m >= self._bins * BIN_M else max(int(last_m / BIN_M) + 1, start)
