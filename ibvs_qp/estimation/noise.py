"""Noise estimated from successive samples, independent of the stated one."""

from __future__ import annotations

from typing import NamedTuple

import casadi as ca

from ibvs_qp.symbolic.logic import Number, where
from ibvs_qp.symbolic.signals import Signals

#: Samples over which noise is averaged: one second at 30 Hz, a standard error of a quarter of the variance.
WINDOW = 30
#: Samples that the noise of the other lines counts for when a new line starts.
PRIOR = 8
#: Bound of one difference in standard deviations once noise is known: a jump is not noise.
CLIP = 4.0


class WhiteNoise(NamedTuple):
    r"""Variance of the white part of a measurement.

    With the residual r of the last sample (after its correction) and the innovation :math:`\nu` of this one,

    .. math:: d = \nu_k - r_{k-1} = n_k - n_{k-1}, \qquad \operatorname{E}[d^2] = 2\,\sigma^2:

    the filter's own error is in both and cancels, so a drifting prediction does not count as noise. Averaging
    :math:`\nu^2` instead (Mehra, 1972) would lower the gain of a filter that is wrong even further.
    """

    variance: ca.SX  # mean of d^2 / 2 [unit^2]
    samples: ca.SX  # differences behind it, at most `WINDOW`
    residual: ca.SX  # innovation left by the last correction; 0 at the first sample, where the filter starts

    def sample(self, difference: ca.SX, claimed: Number) -> ca.SX:
        """Variance by one difference d, clipped [unit^2]; ``claimed`` is the variance by the source [unit^2]."""
        square = 0.5 * difference * difference
        bounded = ca.fmin(square, CLIP * CLIP * ca.fmax(claimed, self.variance))
        return where(self.samples >= PRIOR, bounded, square)

    def averaged(self, sample: ca.SX, counts: ca.SX | None = None) -> WhiteNoise:
        """With one sample of the variance [unit^2], if it counts."""
        samples = ca.fmin(self.samples + 1.0, WINDOW)
        new = self._replace(variance=self.variance + (sample - self.variance) / samples, samples=samples)
        return new if counts is None else WhiteNoise(*map(where, [counts] * 3, new, self))

    def like(self, scale: Number = 1.0) -> WhiteNoise:
        """Prior of a new line from this noise of all lines, converted by ``scale`` [unit^2 / unit^2]."""
        return WhiteNoise(scale * self.variance, ca.fmin(self.samples, PRIOR), ca.SX(0.0))

    def total(self, claimed: Number) -> ca.SX:
        """Variance of one measurement [unit^2]: the claimed one, or more if the samples show more."""
        return ca.fmax(claimed, self.variance)


def vibration_variance(signals: Signals, acceleration: ca.SX, dt: ca.SX, time_s: float) -> ca.SX:
    """Variance of one sample of an acceleration by vibration and sensor [m^2/s^4].

    Motion changes little from tick to tick; vibration above the control bandwidth and sensor noise do not. So half the
    squared difference of successive samples is the variance of one.

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
