"""Noise of the accelerometer, measured in flight: what vibration and sensor add to the motion.

Motion changes little from tick to tick; vibration above the control bandwidth and sensor noise do not. So half the
squared difference of successive samples is the variance of one.
"""

from __future__ import annotations

import casadi as ca

from ibvs_qp.symbolic.logic import Number
from ibvs_qp.symbolic.signals import Signals


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
    return signals.remember("vibration.variance", variance + gain * (0.5 * (acceleration - last) ** 2 - variance))


def noise_density(variance: Number, least: float, dt: Number) -> ca.SX:
    """Power spectral density of white noise with a variance [m^2/s^3], at least ``least`` squared."""
    return ca.fmax(least * least, variance * dt)
