"""The paint job: what the strategy is told, what it sees at a tick, and what it wants."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ibvs_qp.config.settings import setting, validate
from ibvs_qp.estimation.wall_motion import TrackedLine


@dataclass(frozen=True, kw_only=True)
class PaintingConfig:
    """The paint job and the manners of doing it."""

    brush_width_m: float = setting(0.08, "diameter of the brush", unit="m", low=0.02, high=0.3)
    edge_margin_m: float = setting(0.05, "brush centre to the guiding or stopping edge", unit="m", low=0.01, high=0.5)
    rows: int = setting(2, "number of rows", low=1, high=20)
    stroke_m: float = setting(1.30, "length of a row", unit="m", low=0.1, high=20.0)
    overlap_m: float = setting(0.008, "overlap of rows", unit="m", low=0.0, high=0.1)
    speed_m_s: float = setting(0.10, "painting speed", unit="m/s", low=0.01, high=0.5)
    push_n: float = setting(5.0, "push", unit="N", low=0.5, high=40.0)
    climb_speed_m_s: float = setting(0.05, "speed of a climb", unit="m/s", low=0.005, high=0.3)
    acceleration_m_s2: float = setting(0.12, "along a stroke", unit="m/s^2", low=0.01, high=2.0)
    standoff_m: float = setting(0.06, "tip to wall while aligning", unit="m", low=0.02, high=0.5)
    retreat_m: float = setting(0.35, "tip to wall at the end", unit="m", low=0.1, high=2.0)
    align_error_m: float = setting(0.003, "line error that counts as aligned", unit="m", low=0.0005, high=0.05)
    align_speed_m_s: float = setting(0.005, "speed that counts as still", unit="m/s", low=0.001, high=0.1)
    align_time_s: float = setting(0.3, "aligned this long", unit="s", low=0.0, high=10.0)
    align_patience_s: float = setting(
        2.0, "after this long both tolerances open with the square of time", unit="s", low=0.5, high=300.0
    )
    descend_s: float = setting(
        5.0, "after the wall was given up: time of retreat and descent", unit="s", low=0.5, high=60.0
    )
    timeout_s: float = setting(
        15.0, "longest start, approach, align, press, climb or retreat", unit="s", low=1.0, high=300.0
    )

    def __post_init__(self) -> None:
        """Validate."""
        validate(self)

    @property
    def pitch_m(self) -> float:
        """Distance between rows [m]."""
        return self.brush_width_m - self.overlap_m

    @property
    def fresh_edge_m(self) -> float:
        """Upper edge of the last row below the brush centre of the present row [m]."""
        return self.pitch_m - 0.5 * self.brush_width_m


#: No tilt, no travel; shared by all wishes.
NONE = np.zeros(2)
NONE.flags.writeable = False


@dataclass(slots=True)
class Scenery:
    """What the strategy knows at one tick, all of it estimated."""

    time_s: float
    lines: dict[int, TrackedLine]
    odometer: Sequence[float]
    velocity: Sequence[float]
    distance: float
    wall_known: bool
    in_contact: bool
    time_since_touch: float
    push: float
    push_wanted: float
    tared: bool


@dataclass(slots=True)
class Wish:
    """What the strategy wants: guides with the offsets they shall have, velocity, stand-off or push."""

    contact: bool
    standoff: float
    velocity: np.ndarray
    guides: list[tuple[TrackedLine, float]]
    push: float
    tilt: np.ndarray = field(default_factory=lambda: NONE)
    travel: np.ndarray = field(default_factory=lambda: NONE)


def clipped(value: float, low: float, high: float) -> float:
    """The value within its bounds; plain comparisons, because calls of min and max cost several times as much."""
    return low if value < low else high if value > high else value
