"""Measurement noise estimated from successive frames, whatever the source claims."""

from __future__ import annotations

from dataclasses import dataclass, field

#: Frames over which noise is averaged: one second at 30 Hz, a standard error of a quarter of the variance.
WINDOW = 30
#: Frames that the noise of the other lines counts for when a new line starts.
PRIOR = 8
#: Bound of one difference in standard deviations once noise is known: a jump is not noise.
CLIP = 4.0


@dataclass(slots=True)
class WhiteNoise:
    r"""Variance of the white part of a measurement.

    With the residual r of the last frame (after its correction) and the innovation :math:`\nu` of this one,

    .. math:: d = \nu_k - r_{k-1} = n_k - n_{k-1}, \qquad \operatorname{E}[d^2] = 2\,\sigma^2:

    the filter's own error is in both and cancels, so a drifting prediction does not count as noise. Averaging
    :math:`\nu^2` instead (Mehra, 1972) would lower the gain of a filter that is wrong even further.

    Attributes:
        variance: Mean of d^2 / 2 [unit^2].
        count: Differences behind it, at most `WINDOW`.
        residual: Innovation left by the last correction; 0 at the first frame, where the filter starts.
    """

    variance: float = 0.0
    count: int = 0
    residual: float = 0.0

    @classmethod
    def like(cls, other: WhiteNoise, scale: float = 1.0) -> WhiteNoise:
        """Prior of a new line from the noise of the others, converted by ``scale`` [unit^2 / unit^2]."""
        return cls(variance=scale * other.variance, count=min(other.count, PRIOR))

    def learn(self, difference: float, claimed: float) -> float:
        """Average one difference d = innovation - residual; ``claimed`` is the variance by the source [unit^2].

        Returns the sample of the variance after clipping [unit^2].
        """
        sample = 0.5 * difference * difference
        if self.count >= PRIOR:
            sample = min(sample, CLIP * CLIP * max(claimed, self.variance))
        self.average(sample)
        return sample

    def average(self, sample: float) -> None:
        """Average one sample of the variance [unit^2]."""
        self.count = min(self.count + 1, WINDOW)
        self.variance += (sample - self.variance) / self.count

    def total(self, claimed: float) -> float:
        """Variance of one measurement [unit^2]: the claimed one, or more if the frames show more."""
        return max(claimed, self.variance)


@dataclass(slots=True)
class SteadyValue:
    r"""Filter of a value that hardly changes (a line's angle on the wall), with estimated noise.

    A scalar Kalman filter of a random walk. Its variance never falls below noise variance / frames, that of the mean:
    the first frames, before their noise is known, get no more confidence than they deserve.

    Attributes:
        value: The estimate.
        spread: Its variance [unit^2].
        noise: Of the measurements.
        frames: Number of measurements.
    """

    value: float = 0.0
    spread: float = 0.0
    noise: WhiteNoise = field(default_factory=WhiteNoise)
    frames: int = 1

    def correct(self, measured: float, claimed: float, walk: float) -> float:
        """Correct with one measurement.

        ``claimed`` is its variance by the source and ``walk`` that of the random walk since the last one [unit^2].
        Returns the sample of the noise variance, for the prior of other lines.
        """
        innovation = measured - self.value
        sample = self.noise.learn(innovation - self.noise.residual, claimed)
        variance = self.noise.total(claimed)
        spread = max(self.spread + walk, variance / self.frames)
        gain = spread / (spread + variance)
        self.value += gain * innovation
        self.spread, self.noise.residual = spread * (1.0 - gain), (1.0 - gain) * innovation
        self.frames += 1
        return sample
