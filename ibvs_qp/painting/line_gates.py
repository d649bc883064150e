"""Settings of the line choice: how far a line may be from its expected place."""

from __future__ import annotations

from dataclasses import dataclass

from ibvs_qp.config.settings import setting, validate


@dataclass(frozen=True, kw_only=True)
class LineGates:
    """Largest distance of a line from its expected offset, by use of the line."""

    start_m: float = setting(0.15, "guide at start and approach", unit="m", low=0.01, high=1.0)
    row_m: float = setting(
        0.018, "guide from row to row", unit="m", why="a quarter of the distance between rows", low=0.002, high=0.2
    )
    mark_m: float = setting(0.06, "right board edge as mark of the start", unit="m", low=0.005, high=0.5)
    first_stop_m: float = setting(
        0.25, "edge that ends row 1", unit="m", why="its length is nominal", low=0.01, high=2.0
    )
    stop_m: float = setting(
        0.06, "edge that ends a later row", unit="m", why="the odometer has passed both ends", low=0.005, high=0.5
    )
    fresh_lean_deg: float = setting(
        3.0,
        "angle between the fresh edge and the board's edge",
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
