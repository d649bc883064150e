"""The line that leads: the board's edge in row 1, then the upper edge of the row before; its wanted offset slides.

Which line is which: `ibvs_qp.painting.line_choice`. Offsets are in metres around the tip's wall point
(see `TrackedLine`).
"""

from __future__ import annotations

import math

from ibvs_qp.estimation.wall_motion import TrackedLine
from ibvs_qp.painting.job import PaintingConfig, Scenery, clipped
from ibvs_qp.painting.line_choice import FRESH_LEAN, LOST_WEIGHT, ROW_GATE, bottom_edge, fresh_edge

#: A guide's reference slides to its nominal offset at this speed [m/s].
SLIDE_SPEED = 0.01
#: A line of more weight is surely in view.
SURE_WEIGHT = 0.5


class Guide:
    """The leading line by its track, and the offset at which it shall be.

    Attributes:
        identity: Track of the guide, -1 before there is one.
        target: Its wanted offset [m].
    """

    def __init__(self, config: PaintingConfig) -> None:
        self._config = config
        self.identity = self._board = -1
        self.target = config.edge_margin_m
        self._level = 0.5 * math.pi  # angle of the board's edge [rad]

    def take(self, line: TrackedLine, target: float) -> None:
        """Follow this line to this offset [m]."""
        self.identity, self.target = line.track_id, target

    def line(self, seen: Scenery) -> TrackedLine | None:
        """The guide as it is tracked now."""
        return seen.lines.get(self.identity)

    def error(self, seen: Scenery) -> float:
        """How far the guide is from its wanted offset [m]; infinite without one."""
        line = self.line(seen)
        return math.inf if line is None else abs(line.offset - self.target)

    def slide(self, row: int, dt: float) -> None:
        """Let the wanted offset slide towards the nominal one of the row."""
        step = SLIDE_SPEED * dt
        self.target += clipped(self._nominal(row) - self.target, -step, step)

    def keep_board(self, seen: Scenery, gate: float, *, leads: bool) -> TrackedLine | None:
        """Stay with the guide while it lives; when it is gone, look for the board's edge where it must be.

        Args:
            seen: What is seen.
            gate: Farthest that it may be from its wanted offset [m].
            leads: Whether this is row 1, which the board's edge leads: later rows come back to it.

        Returns:
            The new guide, when it changed.
        """
        line, new = self.line(seen), None
        if line is None or line.weight <= LOST_WEIGHT:
            new = self._change(bottom_edge(seen.lines.values(), self.target, gate))
        if leads:
            self._board = self.identity
        return new

    def keep_row(self, seen: Scenery, row: int) -> TrackedLine | None:
        """Stay with the fresh edge while it lives and runs level; else the board's edge leads to the end of the row.

        Returns:
            The new guide, when it changed.
        """
        self._mind_level(seen)
        line = self.line(seen)
        if line is not None and line.weight > LOST_WEIGHT:
            if self.identity == self._board or abs(line.angle - self._level) < FRESH_LEAN:
                return None
        found = self.fresh(seen)
        if found is None:
            found = self._board_edge(seen, row)
            if found is not None:
                # From where it is to where it belongs at the pace of `slide`: what led until now has misled.
                self._board, self.target = found.track_id, found.offset
        return self._change(found)

    def fresh(self, seen: Scenery) -> TrackedLine | None:
        """The upper edge of the last row, where it must be."""
        self._mind_level(seen)
        return fresh_edge(seen.lines.values(), self._config.fresh_edge_m, self._level)

    def _change(self, found: TrackedLine | None) -> TrackedLine | None:
        if found is None or found.track_id == self.identity:
            return None
        self.identity = found.track_id
        return found

    def _mind_level(self, seen: Scenery) -> None:
        """Remember how the board's edge runs, for when it is out of sight."""
        board = seen.lines.get(self._board)
        if board is not None and board.weight > SURE_WEIGHT:
            self._level = board.angle

    def _board_edge(self, seen: Scenery, row: int) -> TrackedLine | None:
        """The board's edge that guided row 1, from a later row."""
        line = seen.lines.get(self._board)
        if line is not None and line.weight > SURE_WEIGHT:
            return line
        return bottom_edge(seen.lines.values(), self._board_nominal(row), 0.5 * self._config.pitch_m)

    def _board_nominal(self, row: int) -> float:
        """Where the board's edge lies below the row [m]."""
        return self._config.edge_margin_m + (row - 1) * self._config.pitch_m

    def _nominal(self, row: int) -> float:
        """Where the present guide shall be: the row's own, or one of the rows before, which stays where it was put."""
        if self.identity == self._board:
            return self._board_nominal(row)
        near = abs(self.target - self._config.fresh_edge_m) < 2.0 * ROW_GATE
        return self._config.fresh_edge_m if near else self.target
