"""Thrust limits that the drive reports: checked and copied when they are assigned."""

from __future__ import annotations

from operator import gt
from typing import Any

import numpy as np

from ibvs_qp.measurement import Measurement
from ibvs_qp.validation.fields import field_table


class ThrustLimits:
    """Lower and upper limits in force.

    Attributes:
        accepted: The last accepted pair [N], (n,) each, not writeable; None for the configured limits.
        rejected: Name and reason of values assigned since and refused.

    Args:
        rotors: Number of rotors.
    """

    def __init__(self, rotors: int) -> None:
        self._sides = [row for row in field_table(Measurement, rotors).rows if row.name in ("thrust_min", "thrust_max")]
        self.reset()

    def reset(self) -> None:
        """Without a report the configured limits are in force."""
        self.accepted: tuple[np.ndarray, np.ndarray] | None = None
        self.rejected: list[str] = []

    def save_memory(self) -> tuple[tuple[np.ndarray, np.ndarray] | None, list[str]]:
        """State of a flight."""
        return self.accepted, self.rejected

    def load_memory(self, values: tuple[tuple[np.ndarray, np.ndarray] | None, list[str]]) -> None:
        """Continue from a state; copies are writeable, those in force are not."""
        self.assign(values[0])
        self.rejected = values[1]

    @np.errstate(all="ignore")  # a host may have numpy raise where a number has no float
    def assign(self, limits: Any) -> None:
        """Take a pair of limits, or None; never raises, and a refused pair leaves the last in force."""
        self.rejected = []
        if limits is None:
            self.accepted = None
            return
        if type(limits) not in (tuple, list) or len(limits) != 2:
            self.rejected.append("thrust_limits: not a pair of lower and upper limits")
            return
        sides = [side.entries(value) for side, value in zip(self._sides, limits, strict=True)]
        for side, entries, value in zip(self._sides, sides, limits, strict=True):
            if entries is None or not side.accepts(entries):
                self.rejected.append(f"thrust_limits: {side.rejection(value)}")
        if not self.rejected and any(map(gt, *sides)):  # type: ignore[arg-type]
            self.rejected.append("thrust_limits: thrust_max below thrust_min")
        if not self.rejected:
            low, high = np.array(sides)
            low.flags.writeable = high.flags.writeable = False
            self.accepted = low, high
