"""True outer edge of every painted stroke, computed from the brush's path."""

from __future__ import annotations

import math

import numpy as np

from sim.world.board import BoardGeometry
from sim.world.scene import Scene

BoardPoint = tuple[float, float] | np.ndarray

#: Length of a bin along the strokes [m].
BIN_M = 0.005
#: A path that moves less along the strokes than this multiple of its way across is a step, not part of a stroke.
_FLATNESS = 1.0


class PaintedEdges:
    """Outermost painted v at every u for every stroke (round brush: its centre plus its radius).

    Pattern coordinates (u, v) are those of `ibvs_qp.pilot.painting.pattern`; the outer edge of a stroke is the one on
    the side of the next stroke.

    Attributes:
        outer: That v [m], -inf without paint, (strokes + 1, bins); stroke 0 is empty.
        open: Bins that are painted and that no later stroke lies over, bool (strokes + 1, bins).
        middles: Middle of each bin, u [m], (bins,). `exposed` updates all three.

    Args:
        scene: Board and paint job.
    """

    def __init__(self, scene: Scene) -> None:
        self._geometry = geometry = BoardGeometry(scene)
        self._first, self._pitch = geometry.stroke_place(1), scene.paint.pitch_m
        self._radius, self._strokes = 0.5 * scene.paint.brush_width_m, geometry.strokes
        length, self._extent = geometry.extent
        self._bins = math.ceil(length / BIN_M)
        self.outer = np.full((self._strokes + 1, self._bins), -math.inf)
        # Bins of a stroke that a later stroke covers, updated by every path.
        self._covered = np.zeros((self._strokes + 1, self._bins), dtype=bool)
        self._reach = math.ceil(self._radius / BIN_M)
        self.open = np.zeros((self._strokes + 1, self._bins), dtype=bool)  # painted and not covered
        self.middles = (np.arange(self._bins) + 0.5) * BIN_M
        self._coming: list[tuple[BoardPoint, BoardPoint]] = []  # paths not yet in the tables

    def stroke(self, previous: BoardPoint | None, current: BoardPoint) -> None:
        """Record a path between two tip positions (along, up) [m]; see `sim.world.canvas.Canvas.stroke`."""
        if previous is not None:
            self._coming.append((previous, current))

    def _catch_up(self) -> None:
        """Add the paths since the last call to the tables."""
        if not self._coming:
            return
        ends = self._geometry.to_pattern(np.array(self._coming, float)).tolist()
        self._coming.clear()
        for previous, current in ends:
            self._add(*previous, *current)

    def _add(self, u0: float, v0: float, u1: float, v1: float) -> None:
        if abs(u1 - u0) <= _FLATNESS * abs(v1 - v0):
            return
        if u0 > u1:
            u0, v0, u1, v1 = u1, v1, u0, v0
        stroke = round((0.5 * (v0 + v1) - self._first) / self._pitch) + 1
        stroke = min(max(stroke, 1), self._strokes)
        outer = self.outer[stroke]
        first, last = max(0, math.floor(u0 / BIN_M)), min(self._bins - 1, math.floor(u1 / BIN_M))
        for k in range(first, last + 1):  # mostly a single bin: plain floats beat arrays
            place = min(max((k + 0.5) * BIN_M, u0), u1)
            edge = v0 + (place - u0) / (u1 - u0) * (v1 - v0) + self._radius
            if edge > outer[k]:
                if outer[k] == -math.inf:
                    over = slice(max(0, k - self._reach), k + self._reach + 1)
                    self._covered[:stroke, over] = True
                    self.open[:stroke, over] = False
                    self.open[stroke, k] = not self._covered[stroke, k]
                outer[k] = edge

    def exposed(self) -> tuple[np.ndarray, np.ndarray]:
        """Points of the outer edges on the board that no later stroke covers: strokes (n,), (u, v) [m] (n, 2)."""
        self._catch_up()
        strokes, bins = (self.open & (self.outer < self._extent)).nonzero()
        points = np.empty((len(strokes), 2))
        points[:, 0], points[:, 1] = self.middles[bins], self.outer[strokes, bins]
        return strokes, points

    def on_board(self, uv: np.ndarray) -> np.ndarray:
        """Board coordinates (along, up) of pattern coordinates [m], (..., 2)."""
        return self._geometry.from_pattern(uv)
