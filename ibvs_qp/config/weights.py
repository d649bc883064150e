"""Weights of the tasks: unit, range and reason of every number.

``python -m sim.report.catalogue`` writes them out beside the tasks that they belong to (docs/tasks_and_limits.md).
Rows are in their own units, so a weight is per squared unit of its row, and the cost has none.
"""

from __future__ import annotations

from dataclasses import dataclass

from ibvs_qp.config.settings import setting, validate


@dataclass(frozen=True, kw_only=True)
class Weights:
    """Weights of the least-squares tasks, each the inverse square of an error one would accept in its unit."""

    line: float = setting(
        100.0,
        "line rows",
        unit="s^4",
        why="0.1 image units/s^2, 5 cm/s^2 half a metre from the wall, as the free velocity rows that they replace",
        low=0.0,
        high=1e6,
    )
    line_angle: float = setting(
        0.05,
        "angle rows of the lines",
        unit="s^4/rad^2",
        why="yields to level flight by four orders: a sloped edge must not tilt the vehicle",
        low=0.0,
        high=1e6,
    )
    push: float = setting(
        0.5,
        "push row, and with 1 - lambda the stand-off row",
        unit="1/N^2",
        why="1.4 N: far below all others, so that an unreachable push is given up first",
        low=0.0,
        high=1e6,
    )
    level: float = setting(
        400.0,
        "roll and pitch rows",
        unit="s^4/rad^2",
        why="0.05 rad/s^2: with 0.7 m to the tip that is 3.5 cm/s^2 there, less than the lines accept",
        low=0.0,
        high=1e6,
    )
    yaw: float = setting(
        400.0,
        "yaw row",
        unit="s^4/rad^2",
        why="0.05 rad/s^2 as roll and pitch: half served beside a push as heavy as the lines, a stuck tip swung by 5 "
        "deg",
        low=0.0,
        high=1e6,
    )
    velocity: float = setting(
        100.0,
        "free velocity rows",
        unit="s^4/m^2",
        why="0.1 m/s^2, as the lines that they stand in for: sideways motion gives way before height and level flight",
        low=0.0,
        high=1e6,
    )
    height: float = setting(
        1.6e3,
        "height row",
        unit="s^4/m^2",
        why="0.025 m/s^2 = 0.15 N: what cannot be pushed must not lift the vehicle",
        low=0.0,
        high=1e6,
    )
    effort: float = setting(
        1e-3,
        "thrust away from the last one",
        unit="1/N^2",
        why="30 N: costs the push 0.004 N rms together with smoothness; ten times as much of both costs 0.04 N",
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
