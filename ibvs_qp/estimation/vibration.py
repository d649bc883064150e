"""Noise of the accelerometer, measured in flight: what vibration and sensor add to the motion.

Motion changes little from tick to tick; vibration above the control bandwidth and sensor noise do not. So half the
squared difference of successive samples is the variance of one.
"""

from __future__ import annotations

import math
from typing import TypeVar

import casadi as ca

from ibvs_qp.symbolic.logic import Number
from ibvs_qp.symbolic.signals import Signals

Value = TypeVar("Value", float, ca.SX)


def averaged(variance: Value, last: Value, sample: Value, gain: Value) -> Value:
    """Variance of one sample [m^2/s^4], by the difference from the last one."""
    return variance + gain * (0.5 * (sample - last) ** 2 - variance)


def vibration_variance(signals: Signals, acceleration: ca.SX, dt: ca.SX, time_s: float) -> ca.SX:
    """Variance of one sample of an acceleration [m^2/s^4].

    Args:
        signals: Registry.
        acceleration: The sample [m/s^2].
        dt: Time since the last one [s].
        time_s: Averaging time [s].
    """
    variance, last, started = (signals.state(f"vibration.{name}") for name in ("variance", "last", "started"))
    gain = ca.fmin(1.0, dt / time_s) * started
    signals.remember("vibration.last", acceleration)
    signals.remember("vibration.started", ca.SX(1.0))
    return signals.remember("vibration.variance", averaged(variance, last, acceleration, gain))


def noise_density(variance: Number, least: float, dt: Number) -> ca.SX:
    """Power spectral density of white noise with a variance [m^2/s^3], at least ``least`` squared."""
    return ca.fmax(least * least, variance * dt)


class VibrationNoise:
    """The same on plain numbers.

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
            self.variance = averaged(self.variance, self._last, acceleration, min(1.0, dt / self._time_s))
        self._last = acceleration

    def density(self, least: float, dt: float) -> float:
        """As `noise_density`."""
        return max(least * least, self.variance * dt)
