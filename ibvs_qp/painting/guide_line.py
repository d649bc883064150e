"""The guide of a row: the board's edge in row 1, then the upper edge of the row before.

Selection among the tracked lines: `ibvs_qp.painting.line_choice`. Offsets are in metres from the tip's wall point
(`TrackedLine`).
"""

from __future__ import annotations

import math

from ibvs_qp.estimation.wall_motion import TrackedLine
from ibvs_qp.painting.command import PainterInput
from ibvs_qp.painting.config import PaintingConfig
from ibvs_qp.painting.line_choice import LOST_WEIGHT, VISIBLE_WEIGHT, bottom_edge, fresh_edge
from ibvs_qp.painting.speed import clipped
from ibvs_qp.painting.tip_height import TipHeight


class GuideLine:
    r"""The guide by its track, with its target offset.

    With a tip that lies :math:`\delta` below the believed one, row 1 lies :math:`\delta` too low. Every later row lies
    one pitch above the painted one: its upper edge is then :math:`\delta` farther below the believed tip.

    Attributes:
        identity: Track of the guide, -1 before there is one.
        target: Its target offset [m].
        tip: Height of the tip, learnt in row 1.
    """

    def __init__(self, config: PaintingConfig) -> None:
        self._config = config
        self.identity = self._board = -1
        self.target = config.edge_margin_m
        self._level = 0.5 * math.pi  # angle of the board's edge [rad]
        self._lean = math.radians(config.gates.fresh_lean_deg)
        self.tip = TipHeight(config)

    def take(self, line: TrackedLine, target: float) -> None:
        """Follow a line to a target offset [m]."""
        self.identity, self.target = line.track_id, target

    @property
    def fresh_offset(self) -> float:
        """Offset of the last row's upper edge when this row is at its place [m]."""
        return self._config.fresh_edge_m + self.tip.error

    def line(self, inputs: PainterInput) -> TrackedLine | None:
        """The guide at this tick, None if it is not tracked."""
        return inputs.lines.get(self.identity)

    def error(self, inputs: PainterInput) -> float:
        """Distance of the guide from its target [m]; infinite without a guide."""
        line = self.line(inputs)
        return math.inf if line is None else abs(line.offset - self.target)

    def displacement(self, inputs: PainterInput) -> float:
        """Offset of the guide beyond its target [m]; zero without a guide."""
        line = self.line(inputs)
        return 0.0 if line is None else line.offset - self.target

    def slide(self, row: int, dt: float) -> None:
        """Move the target towards the nominal offset of the row for a tick of dt [s]."""
        step = self._config.guide_slide_m_s * dt
        self.target += clipped(self._nominal(row) - self.target, -step, step)

    def follow_board(self, inputs: PainterInput, gate: float, *, first_row: bool) -> TrackedLine | None:
        """Follow the board's edge up to row 1; a lost guide is searched within a gate [m] of its target.

        Later rows can return to the guide of row 1. Returns the new guide, if it changed.
        """
        line, new = self.line(inputs), None
        if line is None or line.weight <= LOST_WEIGHT:
            new = self._change(bottom_edge(inputs.lines.values(), self.target, gate))
        if first_row:
            self._board = self.identity
        return new

    def follow_row(self, inputs: PainterInput, row: int) -> TrackedLine | None:
        """Follow the fresh edge while it is tracked and level; otherwise the board's edge to the end of the row.

        Returns the new guide, if it changed.
        """
        self._update_level(inputs)
        line = self.line(inputs)
        if line is not None and line.weight > LOST_WEIGHT:
            if self.identity == self._board or abs(line.angle - self._level) < self._lean:
                return None
        found = self.fresh(inputs)
        if found is None:
            found = self._board_edge(inputs, row)
            self._board = self._board if found is None else found.track_id
        if found is not None:
            # The lost guide had another target, or has misled: slide from the present offset to the nominal one.
            self.target = found.offset
        return self._change(found)

    def fresh(self, inputs: PainterInput, displacement: float = 0.0) -> TrackedLine | None:
        """The upper edge of the last row, if it is seen at its nominal offset plus a known displacement [m]."""
        self._update_level(inputs)
        expected = self.fresh_offset + displacement
        return fresh_edge(inputs.lines.values(), expected, self._level, self._config.gates)

    def _change(self, found: TrackedLine | None) -> TrackedLine | None:
        if found is None or found.track_id == self.identity:
            return None
        self.identity = found.track_id
        return found

    def _update_level(self, inputs: PainterInput) -> None:
        """Store the angle of the board's edge for the time when it is out of view."""
        board = inputs.lines.get(self._board)
        if board is not None and board.weight > VISIBLE_WEIGHT:
            self._level = board.angle

    def _board_edge(self, inputs: PainterInput, row: int) -> TrackedLine | None:
        """The board's edge that guided row 1, from a later row."""
        line = inputs.lines.get(self._board)
        if line is not None and line.weight > VISIBLE_WEIGHT:
            return line
        return bottom_edge(inputs.lines.values(), self._board_nominal(row), 0.5 * self._config.pitch_m)

    def _board_nominal(self, row: int) -> float:
        """Offset of the board's edge in a row [m]."""
        return self._config.edge_margin_m + (row - 1) * self._config.pitch_m

    def _nominal(self, row: int) -> float:
        """Nominal offset of the guide [m]; a guide from an earlier row keeps its last target."""
        if self.identity == self._board:
            return self._board_nominal(row)
        near = abs(self.target - self.fresh_offset) < 2.0 * self._config.gates.row_m
        return self.fresh_offset if near else self.target
