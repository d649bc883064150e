"""Where a row ends: the upright edge ahead, once it is seen where it must be; until then the odometer.

Which line is which: `ibvs_qp.painting.line_choice`. Offsets are in metres around the tip's wall point
(see `TrackedLine`).
"""

from __future__ import annotations

import math

from ibvs_qp.estimation.wall_motion import TrackedLine
from ibvs_qp.painting.job import PaintingConfig, Scenery
from ibvs_qp.painting.line_choice import FIRST_STOP_GATE, LOST_WEIGHT, STOP_GATE, stop_edge

#: Share of a stroke after which its end may come.
LEAST_STROKE = 0.5
#: How far past its nominal length row 1 may run in search of its end [m].
OVERRUN = 0.10


class RowEnd:
    """The edge that ends the row by its track, its wanted offset, and both ends of row 1 on the odometer.

    Attributes:
        right_margin: Offset of the board's right edge where row 1 begins [m]; None when it was not seen.
    """

    def __init__(self, config: PaintingConfig) -> None:
        self._config = config
        self._identity, self._target = -1, math.nan
        self._first, self._last = math.nan, math.nan  # where row 1 began and ended [m]
        self.right_margin: float | None = None

    def begin_first_row(self, place: float) -> None:
        """Row 1 begins at this place on the odometer [m]."""
        self._first = place

    def end_first_row(self, place: float) -> None:
        """Row 1 ends at this place on the odometer [m]."""
        self._last = place

    def forget(self) -> None:
        """Another row begins: its end is not in view yet."""
        self._identity, self._target = -1, math.nan

    def remaining(self, seen: Scenery, row: int) -> tuple[float, TrackedLine | None]:
        """Way left in the row [m] and the upright edge that ends it, once accepted."""
        config, travel = self._config, travel_of(row)
        place = float(seen.odometer[0])
        travelled = abs(place - self._first)
        if row == 1:
            ahead = config.stroke_m - travelled
        else:
            ahead = place - self._last if travel < 0 else self._first - place
        margin = self._margin(travel)
        edge = seen.lines.get(self._identity)
        lost = edge is None or edge.weight < LOST_WEIGHT
        if lost and travelled > LEAST_STROKE * config.stroke_m * (row == 1):
            known = travel < 0 or self.right_margin is not None
            gate, expected = FIRST_STOP_GATE if row == 1 else STOP_GATE, margin + travel * max(ahead, 0.0)
            edge = stop_edge(seen.lines.values(), travel, expected, gate) if known else None
        if edge is not None:
            self._identity = edge.track_id
            return travel * (edge.offset - margin), edge
        self.forget()
        if row == 1:
            return ahead + OVERRUN, None  # the stroke ends at the edge, which may come a little late
        return ahead, None

    def beside_climb(self, seen: Scenery, row: int) -> TrackedLine | None:
        """The edge at which the row ended; brush and paint may have hidden it for a while.

        Args:
            seen: What is seen.
            row: Row that ended.
        """
        edge = seen.lines.get(self._identity)
        if edge is not None and edge.weight >= LOST_WEIGHT:
            return edge
        travel = travel_of(row)
        known = travel < 0 or self.right_margin is not None
        edge = stop_edge(seen.lines.values(), travel, self._margin(travel), STOP_GATE) if known else None
        self._identity = -1 if edge is None else edge.track_id
        return edge

    def reference(self, edge: TrackedLine, rate: float, row: int, *, reached: bool) -> float:
        """The edge's wanted offset: from where it was first seen to the margin, at the stroke's own speed.

        Args:
            edge: The edge.
            rate: Way since the last tick, towards the margin [m].
            row: Row that it ends.
            reached: Whether the row has ended: then it shall be at the margin.

        Returns:
            The wanted offset [m].
        """
        travel = travel_of(row)
        margin = self._margin(travel)
        if math.isnan(self._target):
            self._target = edge.offset
        self._target += rate
        if reached or travel * (self._target - margin) < 0.0:
            self._target = margin
        return self._target

    def _margin(self, travel: float) -> float:
        """Where the edge shall be as the row ends [m]."""
        return travel * (
            self._config.edge_margin_m if travel < 0 else (self.right_margin or self._config.edge_margin_m)
        )


def travel_of(row: int) -> float:
    """Direction of a row: -1 to the left in the first and every other one, +1 to the right."""
    return -1.0 if row % 2 == 1 else 1.0
