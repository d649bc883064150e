"""Weights of the tasks: unit, range and reason of every number.

``python -m sim.report.catalogue`` writes them out beside the tasks that they belong to (docs/tasks_and_limits.md).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ibvs_qp.config.settings import setting, validate


def _weight(default: float, rows: str, unit: str, why: str) -> Any:
    """Setting of a weight per squared unit of its rows, so that the cost has no unit."""
    return setting(default, rows, unit=unit, why=why, low=0.0, high=1e6)


@dataclass(frozen=True, kw_only=True)
class Weights:
    """Weights of the least-squares tasks, each the inverse square of an acceptable error in its unit."""

    line: float = _weight(100.0, "line rows", "s^4", "0.1 image units/s^2: 5 cm/s^2 half a metre from the wall")
    line_angle: float = _weight(
        0.05, "angle rows of the lines", "s^4/rad^2", "four orders below level flight: a sloped edge must not tilt"
    )
    push: float = _weight(
        0.5,
        "push row, and with 1 - lambda the stand-off row",
        "1/N^2",
        "1.4 N: far below all others, so an unreachable push yields first",
    )
    level: float = _weight(
        400.0, "roll and pitch rows", "s^4/rad^2", "0.05 rad/s^2: 3.5 cm/s^2 at the tip, less than the lines accept"
    )
    yaw: float = _weight(
        400.0, "yaw row", "s^4/rad^2", "as roll and pitch; with 60 a vehicle whose rotors weaken hits the ground"
    )
    velocity: float = _weight(
        100.0, "free velocity rows", "s^4/m^2", "0.1 m/s^2, as the lines: yields before height and level flight"
    )
    height: float = _weight(
        1.6e3, "height row", "s^4/m^2", "0.025 m/s^2 = 0.15 N: an unreachable push must not lift the vehicle"
    )
    margin: float = _weight(
        0.01, "redundant thrusts, of more than six rotors", "1/N^2", "10 N: above effort, below every task"
    )
    effort: float = setting(
        1e-3,
        "thrust away from the last one",
        unit="1/N^2",
        why="30 N: costs the push 0.004 N rms together with smoothness",
        low=1e-9,
        high=1e3,
    )
    smoothness: float = setting(
        1e-3, "change of the thrust step", unit="1/N^2", why="30 N, as the effort row", low=0.0, high=1e3
    )
    line_sigma: float = setting(2e-2, "line deviation at which a row's weight halves", low=1e-6, high=1.0)

    def __post_init__(self) -> None:
        """Validate."""
        validate(self)
