"""A line on the wall, tracked from frame to frame."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(slots=True)
class TrackedLine:
    """One line on the wall, in metres from the tip's wall point.

    Attributes:
        track_id: Identity that perception gives it.
        role: "horizontal" or "vertical".
        slot: Its place among the lines in the filter's state.
        angle: Angle of the normal in (right, down) [rad]; pi/2 for a level line.
        deviation: Standard deviation of the filtered offset [m], from the noise that the frames show.
        seen_ns: Capture time of the last frame that shows it; fresh_ns: tick at which that frame arrived.
        frames: Number of frames that showed it.
        offset: Signed distance from the tip to the line along its normal [m]; normals point down (horizontal lines)
            or right (vertical lines), so > 0 is below or right of the tip.
        weight: Its weight now; fresh_weight: its weight at the last frame.
        surface_side, kind: As in `ibvs_qp.measurement.LineFeature`.
        theta_variance: Of the filtered angle [rad^2].
        residual: Innovation of the last measured offset that its correction left [m].
        seen_angle, middle, length: Angle [rad], middle and length [m] of the visible piece in the last frame, as in
            `ibvs_qp.estimation.wall_lines.MeasuredLine`; NaN and 0 without end points.
    """

    track_id: int
    role: str
    slot: int
    angle: float
    deviation: float
    seen_ns: int
    fresh_ns: int = 0
    frames: int = 1
    offset: float = 0.0
    weight: float = 0.0
    fresh_weight: float = 0.0
    surface_side: int = 0
    kind: str = ""
    theta_variance: float = 1e-4
    residual: float = 0.0
    seen_angle: float = math.nan
    middle: float = math.nan
    length: float = 0.0

    @property
    def seen_offset(self) -> float:
        """Offset that the last frame shows, moved to now [m]; `offset` is filtered."""
        return self.offset + self.residual
