"""Noise of the accelerometer, measured in flight: what vibration and sensor add to the motion."""

from __future__ import annotations

import math


class VibrationNoise:
    """Variance of one sample of an acceleration, from the differences of successive samples.

    Motion changes little from tick to tick; vibration above the control bandwidth and sensor noise do not.

    Attributes:
        variance: Of one sample [m^2/s^4].

    Args:
        time_s: Averaging time [s].
    """

    def __init__(self, time_s: float) -> None:
        self._time_s = time_s
        self.reset()

    def reset(self) -> None:
        """Return to the state before the first sample."""
        self.variance, self._last = 0.0, math.nan

    def add(self, acceleration: float, dt: float) -> None:
        """Add a sample [m/s^2], ``dt`` [s] after the last."""
        if not math.isnan(self._last):
            gain = min(1.0, dt / self._time_s)
            self.variance += gain * (0.5 * (acceleration - self._last) ** 2 - self.variance)
        self._last = acceleration

    def density(self, least: float, dt: float) -> float:
        """Power spectral density of white noise with this variance [m^2/s^3], at least ``least`` squared."""
        return max(least * least, self.variance * dt)
