"""Push on the wall from the contact wrench: first-order filter, and its noise in free flight."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ibvs_qp.config import ContactSettings
from ibvs_qp.estimation.stamps import sample_interval
from ibvs_qp.frames import dot

#: Variance of the filtered push before free flight shows it [N^2].
FIRST_PUSH_VARIANCE = 0.02


class PushFilter:
    """Filtered push and contact moment.

    Attributes:
        push: Filtered push [N].

    Args:
        settings: Filter and averaging time.
    """

    def __init__(self, settings: ContactSettings) -> None:
        self._settings = settings
        self.reset()

    def reset(self) -> None:
        """Return to the state before the first sample."""
        self._stamp = -1
        self.push = 0.0
        self._push_mean, self._push_variance = 0.0, FIRST_PUSH_VARIANCE
        self._moment, self._moment_variance = [0.0, 0.0, 0.0], 0.0

    @property
    def push_noise(self) -> float:
        """Standard deviation of the filtered push in free flight [N]."""
        return math.sqrt(self._push_variance)

    @property
    def moment_noise(self) -> float:
        """Standard deviation of a filtered moment in free flight [N m]."""
        return math.sqrt(self._moment_variance)

    def add(self, wrench: np.ndarray, stamp_ns: int, normal: Sequence[float], free: bool) -> float | None:
        """Filter the contact wrench ON the vehicle [N, N m], (6,), of one force sample.

        A sample in ``free`` flight, away from the wall, is noise. Returns the time since the last sample [s]; None if
        this sample is not a new one.
        """
        if stamp_ns <= self._stamp:
            return None
        dt = sample_interval(stamp_ns, self._stamp)
        self._stamp = stamp_ns
        sample = wrench.tolist()
        gain = 1.0 - math.exp(-2.0 * math.pi * self._settings.force_filter_hz * dt)
        self.push += gain * (-dot(sample, normal) - self.push)
        self._moment = [old + gain * (new - old) for old, new in zip(self._moment, sample[3:], strict=True)]
        if free:
            self._learn_noise(min(1.0, dt / self._settings.estimation.noise_time_s))
        return dt

    def _learn_noise(self, gain: float) -> None:
        self._push_mean += gain * (self.push - self._push_mean)
        self._push_variance += gain * ((self.push - self._push_mean) ** 2 - self._push_variance)
        # Half the squared length: two of the three moments come from forces across the tip.
        self._moment_variance += gain * (0.5 * dot(self._moment, self._moment) - self._moment_variance)
