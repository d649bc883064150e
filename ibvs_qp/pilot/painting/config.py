"""Settings of a paint job: its geometry, speeds, tolerances and time-outs, and the gates of its lines."""

from __future__ import annotations

from dataclasses import dataclass, field

from ibvs_qp.config.settings import Derived, choice, setting, validate
from ibvs_qp.pilot.painting.pattern import CORNERS, FILL, PATTERNS


@dataclass(frozen=True, kw_only=True)
class LineGates:
    """Largest distance of a line from its expected offset, by use of the line."""

    start_m: float = setting(
        0.7, "board edge that guides stroke 1", unit="m", why="a start 0.5 m away, and a margin", low=0.01, high=2.0
    )
    mark_m: float = setting(
        0.045,
        "board edge next to the beginning: nearer to its place, it marks it",
        unit="m",
        why="a start placed by hand within 2 cm, turned by 3 deg at 0.45 m",
        low=0.005,
        high=0.5,
    )
    first_stop_m: float = setting(
        0.25, "edge that ends stroke 1", unit="m", why="its length is nominal", low=0.01, high=2.0
    )
    stop_m: float = setting(
        0.06, "edge that ends a later stroke", unit="m", why="the odometer has passed both ends", low=0.005, high=0.5
    )
    fresh_lean_deg: float = setting(
        5.0,
        "angle to the board's edge up to which a painted edge leads",
        unit="deg",
        why="at 6 deg the short end of a bent stroke rolls the vehicle",
        low=0.5,
        high=30.0,
    )
    start_deviation_m: float = setting(
        0.01, "largest standard deviation of the guide at start", unit="m", low=0.001, high=0.1
    )

    def __post_init__(self) -> None:
        """Validate."""
        validate(self)


@dataclass(frozen=True, kw_only=True)
class PaintingConfig:
    """The paint job and how it is executed."""

    brush_width_m: float = setting(0.08, "diameter of the brush", unit="m", low=0.02, high=0.3)
    edge_margin_m: float = setting(0.05, "brush centre to the guiding or stopping edge", unit="m", low=0.01, high=0.5)
    pattern: str = choice("rows", "direction of the strokes", PATTERNS)
    start: str = choice("bottom-right", "corner of the board at which stroke 1 begins", CORNERS)
    rows: int | str = setting(
        2, "number of strokes of either pattern, or as many as the board has place for", low=1, high=20, words=(FILL,)
    )
    stroke_m: float = setting(1.30, "length of a stroke", unit="m", low=0.1, high=20.0)
    begins_at_margin: bool = setting(
        True,
        "stroke 1 begins at the margin from the edge beside it; false: only the edge at its end shows where it begins",
    )
    overlap_m: float = setting(0.008, "overlap of strokes", unit="m", low=0.0, high=0.1)
    speed_m_s: float = setting(0.10, "painting speed", unit="m/s", low=0.01, high=0.5)
    push_n: float = setting(5.0, "push", unit="N", low=0.5, high=40.0)
    climb_speed_m_s: float = setting(0.05, "speed of a climb", unit="m/s", low=0.005, high=0.3)
    acceleration_m_s2: float = setting(
        0.12, "along a stroke and a climb; braking takes twice as much", unit="m/s^2", low=0.01, high=2.0
    )
    standoff_m: float = setting(0.06, "tip to wall while aligning", unit="m", low=0.02, high=0.5)
    retreat_m: float = setting(0.35, "tip to wall at the end", unit="m", low=0.1, high=2.0)

    hold_gain: float = setting(
        0.8, "position error on the odometer to speed, without an upright line", unit="1/s", low=0.0, high=5.0
    )
    hold_speed_m_s: float = setting(0.03, "largest speed of that position hold", unit="m/s", low=0.0, high=0.2)
    guide_slide_m_s: float = setting(
        0.01, "speed at which a guide's target slides to its nominal offset", unit="m/s", low=0.001, high=0.1
    )
    gates: LineGates = field(default_factory=LineGates)

    guide_reach_m: float = setting(
        Derived(0.24),
        "farthest edge that leads along a stroke, from the tip; a pilot's follows from its camera unless it is stated",
        unit="m",
        why="at the wall the picture shows 0.27 m below the tip, and the view barrier must not hold the vehicle back",
        low=0.02,
        high=2.0,
    )
    align_error_m: float = setting(0.003, "line error that counts as aligned", unit="m", low=0.0005, high=0.05)
    align_speed_m_s: float = setting(0.005, "speed that counts as still", unit="m/s", low=0.001, high=0.1)
    align_time_s: float = setting(0.3, "aligned this long", unit="s", low=0.0, high=10.0)
    align_average_s: float = setting(
        0.4, "average of error and speed", unit="s", why="half a period of the sway in hover", low=0.01, high=5.0
    )
    align_patience_s: float = setting(
        2.0, "then both tolerances open with the square of time", unit="s", low=0.5, high=300.0
    )
    align_opening_max: float = setting(
        5.0, "largest factor on both", why="15 mm and 25 mm/s: errors with gusts of 3 N rms", low=1.0, high=20.0
    )
    press_time_s: float = setting(
        1.2, "least time in contact before a stroke", unit="s", why="the force ramp takes 1 s", low=0.0, high=10.0
    )
    press_error: float = setting(0.15, "largest relative error of the push before a stroke", low=0.01, high=1.0)
    contact_back_s: float = setting(
        0.5, "contact after a loss for this long before a stroke goes on", unit="s", low=0.0, high=10.0
    )
    stop_error_m: float = setting(0.003, "distance to its end at which a row stops", unit="m", low=0.0005, high=0.05)
    stop_time_s: float = setting(0.15, "least time of a stop", unit="s", low=0.0, high=5.0)
    stop_timeout_s: float = setting(
        0.8, "longest time of a stop", unit="s", why="stiction may hold the last millimetres", low=0.1, high=10.0
    )
    start_look_s: float = setting(
        2.0, "time without a guide before the vehicle steps back for a wider view", unit="s", low=0.0, high=60.0
    )
    wide_view_m: float = setting(
        1.2,
        "tip to wall where it stops stepping back",
        unit="m",
        why="0.5 m around the tip are in view",
        low=0.1,
        high=5.0,
    )
    survey_speed_m_s: float = setting(
        0.15, "speed of a move along the wall in free flight", unit="m/s", low=0.01, high=1.0
    )
    search_standoff_m: float = setting(
        0.15,
        "tip to wall while a lost edge is searched",
        unit="m",
        why="the brush hides less from there",
        low=0.02,
        high=1.0,
    )
    search_back_m: float = setting(0.15, "way back along the last stroke for that search", unit="m", low=0.0, high=1.0)
    least_certainty_m: float = setting(
        0.004,
        "three standard deviations up to which a place counts as certain at any overlap",
        unit="m",
        why="half of the default overlap; no edge is known better than to 1 mm",
        low=0.0005,
        high=0.05,
    )
    climb_error_m: float = setting(0.004, "error of the guide that ends a climb", unit="m", low=0.0005, high=0.05)
    climb_time_s: float = setting(0.3, "least time at the end of a climb", unit="s", low=0.0, high=5.0)
    climb_timeout_s: float = setting(1.0, "longest time for that error", unit="s", low=0.0, high=10.0)
    climb_stuck_m: float = setting(
        0.005,
        "error after that time from which the stroke begins; beyond it the brush leaves the wall and touches again",
        unit="m",
        why="friction holds the tip; with the waves of both strokes the band still touches the last one",
        low=0.0005,
        high=0.05,
    )
    fresh_edge_timeout_s: float = setting(
        2.0, "longest search for the fresh edge after a climb", unit="s", low=0.0, high=20.0
    )
    descend_s: float = setting(5.0, "retreat and descent after the wall was abandoned", unit="s", low=0.5, high=60.0)
    descend_speed_m_s: float = setting(
        0.15, "speed of that descent", unit="m/s", why="slow: nothing measures the height", low=0.01, high=1.0
    )
    timeout_s: float = setting(
        15.0,
        "longest start, approach, align, press, climb or retreat, added to the time of its way",
        unit="s",
        low=1.0,
        high=300.0,
    )

    def __post_init__(self) -> None:
        """Validate."""
        validate(self)

    @property
    def pitch_m(self) -> float:
        """Distance between rows [m]."""
        return self.brush_width_m - self.overlap_m
