"""How noisy a line is, learned from its pictures alone: nobody tells the filter sigma."""

from __future__ import annotations

from dataclasses import dataclass, field

#: Pictures over which noise is averaged: one second at 30 Hz, a quarter of uncertainty in a variance.
WINDOW = 30
#: Pictures that the noise of the other lines counts for when a new line begins.
PRIOR = 8
#: One difference counts at most as so many standard deviations once noise is known: a leap is not noise.
CLIP = 4.0


@dataclass(slots=True)
class WhiteNoise:
    r"""Variance of the white part of a measurement beyond what its source claims.

    With the residual r of the last picture (after its correction) and the innovation :math:`\nu` of this one,

    .. math:: d = \nu_k - r_{k-1} = n_k - n_{k-1}, \qquad \operatorname{E}[d^2] = 2\,\sigma^2:

    the filter's own error is in both and drops out. So a prediction that drifts is not taken for noise; averaging
    :math:`\nu^2` instead (Mehra, 1972) would teach a filter that is wrong to listen even less.

    Attributes:
        variance: Mean of d^2 / 2 [unit^2].
        count: Differences behind it, at most `WINDOW`.
    """

    variance: float = 0.0
    count: int = 0
    _residual: float = 0.0

    @classmethod
    def like(cls, other: WhiteNoise, scale: float = 1.0) -> WhiteNoise:
        """The noise to expect of a new line from what the others have shown, in another unit [unit^2 / unit^2]."""
        return cls(variance=scale * other.variance, count=min(other.count, PRIOR))

    def difference(self, innovation: float) -> float:
        """Innovation less the last residual (of the first picture: 0, it is where the filter starts)."""
        return innovation - self._residual

    def learn(self, difference: float, claimed: float) -> float:
        """Take in one difference.

        Args:
            difference: d.
            claimed: Variance that the source claims [unit^2].

        Returns:
            The sample of the variance that was believed [unit^2].
        """
        sample, count, variance = 0.5 * difference * difference, self.count, self.variance
        if count >= PRIOR:
            most = CLIP * CLIP * (claimed if claimed > variance else variance)
            sample = most if most < sample else sample
        self.count = count = count + 1 if count < WINDOW else WINDOW
        self.variance = variance + (sample - variance) / count
        return sample

    def hear(self, sample: float, claimed: float) -> float:
        """`learn` and `keep` of a signal without a prediction, in one call; the variance of one sample then.

        Args:
            sample: Its value now [unit].
            claimed: Variance that the source claims [unit^2].
        """
        difference, self._residual = sample - self._residual, sample
        self.learn(difference, claimed)
        variance = self.variance
        return claimed if claimed > variance else variance

    def mix(self, sample: float) -> None:
        """Average one sample of the variance."""
        self.count = count = self.count + 1 if self.count < WINDOW else WINDOW
        self.variance += (sample - self.variance) / count

    def total(self, claimed: float) -> float:
        """Variance of the measurement: what is claimed, or more if the pictures show more [unit^2]."""
        variance = self.variance
        return variance if variance > claimed else claimed

    def keep(self, residual: float) -> None:
        """Remember what the correction has left of the innovation."""
        self._residual = residual


@dataclass(slots=True)
class SteadyValue:
    r"""A value that hardly changes (a line's angle on the wall), filtered with a noise that it learns.

    A scalar Kalman filter of a random walk. Its covariance never falls below variance / pictures, the mean's: what
    was concluded from few pictures, before their noise was known, is not believed longer than it deserves.

    Attributes:
        value: The estimate.
        spread: Its variance [unit^2].
    """

    value: float = 0.0
    spread: float = 0.0
    noise: WhiteNoise = field(default_factory=WhiteNoise)
    pictures: int = 1

    def correct(self, measured: float, claimed: float, walk: float) -> float:
        """Take in one measurement.

        Args:
            measured: The measurement.
            claimed: Variance that its source claims [unit^2].
            walk: Variance of the random walk since the last one [unit^2].

        Returns:
            The sample of the noise's variance, for the other lines.
        """
        noise, innovation, pictures = self.noise, measured - self.value, self.pictures
        sample = noise.learn(noise.difference(innovation), claimed)
        variance = noise.total(claimed)
        spread, least = self.spread + walk, variance / pictures
        if spread < least:
            spread = least
        gain = spread / (spread + variance)
        self.value += gain * innovation
        self.spread = spread * (1.0 - gain)
        self.pictures = pictures + 1
        noise.keep((1.0 - gain) * innovation)
        return sample
