"""End of a stroke: the upright edge ahead once it is seen at its expected place, until then the odometer.

`StrokeEnd.remaining` is the distance that is left, `StrokeEnd.is_reached` the stop condition. Selection among the
tracked lines: `ibvs_qp.painting.line_choice`. Offsets are in metres from the tip's wall point (`TrackedLine`).
"""

from __future__ import annotations

import math

from ibvs_qp.estimation.wall_motion import TrackedLine
from ibvs_qp.painting.command import PainterInput
from ibvs_qp.painting.config import PaintingConfig
from ibvs_qp.painting.line_choice import LOST_WEIGHT, stop_edge

#: Fraction of row 1 after which its end is searched.
SEARCH_FRACTION = 0.5
#: Remaining distance at which the commanded speed becomes zero [m].
STOP_DISTANCE = 0.004
#: Speed at a stop relative to `PaintingConfig.align_speed_m_s`.
STOP_SPEED_RATIO = 2.0


class StrokeEnd:
    """The edge that ends a row, by its track, and both ends of row 1 on the odometer.

    Attributes:
        right_margin: Offset of the board's right edge where row 1 begins [m]; None if it was not seen.
    """

    def __init__(self, config: PaintingConfig) -> None:
        self._config = config
        self._identity, self._target = -1, math.nan
        self._first, self._last = math.nan, math.nan  # odometer at begin and end of row 1 [m]
        self._stop_time = math.nan
        self.right_margin: float | None = None

    def begin_row(self, row: int, inputs: PainterInput) -> None:
        """A row begins here; its end is not in view yet."""
        self._forget()
        self._stop_time = math.nan
        if row == 1:
            self._first = float(inputs.odometer[0])

    def end_row(self, row: int, inputs: PainterInput) -> None:
        """A row ends here."""
        if row == 1:
            self._last = float(inputs.odometer[0])

    def remaining(self, inputs: PainterInput, row: int) -> tuple[float, TrackedLine | None]:
        """Distance left in the row [m] and the upright edge that ends it, None until one is accepted."""
        config, travel = self._config, travel_of(row)
        place = float(inputs.odometer[0])
        travelled = abs(place - self._first)
        if row == 1:
            ahead = config.stroke_m - travelled
        else:
            ahead = place - self._last if travel < 0 else self._first - place
        margin = self._margin(travel)
        edge = inputs.lines.get(self._identity)
        lost = edge is None or edge.weight < LOST_WEIGHT
        if lost and (row > 1 or travelled > SEARCH_FRACTION * config.stroke_m):
            gate = config.gates.first_stop_m if row == 1 else config.gates.stop_m
            edge = self._search(inputs, travel, margin + travel * max(ahead, 0.0), gate)
        if edge is not None:
            self._identity = edge.track_id
            return travel * (edge.offset - margin), edge
        self._forget()
        if row == 1:
            return ahead + config.overrun_m, None  # the edge may come later than the nominal length
        return ahead, None

    def is_reached(self, inputs: PainterInput, remaining: float) -> bool:
        """Stop condition of a stroke with that distance left [m]: near the end and still, or waited for too long."""
        config = self._config
        if remaining > STOP_DISTANCE:
            return False
        if math.isnan(self._stop_time):
            self._stop_time = inputs.time_s
        waited = inputs.time_s - self._stop_time
        still = abs(inputs.velocity[0]) < STOP_SPEED_RATIO * config.align_speed_m_s
        near = remaining < config.stop_error_m
        return (waited > config.stop_time_s and still and near) or waited > config.stop_timeout_s

    def beside_climb(self, inputs: PainterInput, row: int) -> TrackedLine | None:
        """The edge at which a row ended; brush and paint may hide it for a while."""
        edge = inputs.lines.get(self._identity)
        if edge is not None and edge.weight >= LOST_WEIGHT:
            return edge
        travel = travel_of(row)
        edge = self._search(inputs, travel, self._margin(travel), self._config.gates.stop_m)
        self._identity = -1 if edge is None else edge.track_id
        return edge

    def reference(self, edge: TrackedLine, rate: float, row: int, *, reached: bool) -> float:
        """Target offset of the edge of a row [m]: from its first measured one to the margin at the speed of the stroke.

        ``rate`` is the change since the last tick [m]; once the row's end is reached the target is the margin.
        """
        travel = travel_of(row)
        margin = self._margin(travel)
        if math.isnan(self._target):
            self._target = edge.offset
        self._target += rate
        if reached or travel * (self._target - margin) < 0.0:
            self._target = margin
        return self._target

    def _forget(self) -> None:
        self._identity, self._target = -1, math.nan

    def _search(self, inputs: PainterInput, travel: float, expected: float, gate: float) -> TrackedLine | None:
        if travel > 0 and self.right_margin is None:
            return None
        return stop_edge(inputs.lines.values(), travel, expected, gate)

    def _margin(self, travel: float) -> float:
        """Offset of the edge at the end of the row [m]."""
        margin = self._config.edge_margin_m
        return travel * (margin if travel < 0 else (self.right_margin or margin))


def travel_of(row: int) -> float:
    """Direction of a row: -1 to the left in the first and every other one, +1 to the right."""
    return -1.0 if row % 2 == 1 else 1.0
