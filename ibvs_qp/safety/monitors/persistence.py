"""Conditions that count only once they have lasted."""

from __future__ import annotations

import math


class Persistence:
    """True once a condition has held for a time without a break.

    Args:
        time_s: The time [s].
    """

    def __init__(self, time_s: float) -> None:
        self._time_s = time_s
        self.reset()

    def reset(self) -> None:
        """As before the first tick."""
        self._since = math.nan

    def update(self, present: bool, time_s: float) -> bool:
        """Whether the condition, ``present`` or not at a time [s], has lasted."""
        if not present:
            self._since = math.nan
            return False
        if math.isnan(self._since):
            self._since = time_s
        return time_s - self._since >= self._time_s
