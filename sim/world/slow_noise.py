"""Noise with a correlation time, and vectors of random direction."""

from __future__ import annotations

import math

import numpy as np

from sim.world.random_streams import Normals


def random_direction(normals: Normals, size: int) -> np.ndarray:
    """Unit vector of uniform direction, (size,)."""
    vector = np.array(normals.take(size))
    return vector / np.linalg.norm(vector)


class SlowNoise:
    r"""First-order Gauss-Markov process, stationary from its first value on.

    :math:`x_{k+1} = a x_k + \sigma \sqrt{1 - a^2}\, n_k` with :math:`a = e^{-dt / \tau}`.

    Args:
        sigma: Standard deviation of every entry.
        time_s: Correlation time [s].
        period_s: Time between values [s].
        normals: Source.
        size: Number of entries.
    """

    def __init__(self, sigma: float, time_s: float, period_s: float, normals: Normals, size: int) -> None:
        self._normals, self._size = normals, size
        self._decay = math.exp(-period_s / time_s)
        self._kick = sigma * math.sqrt(1.0 - self._decay**2)
        self._value = sigma * np.array(normals.take(size))

    def next(self) -> np.ndarray:
        """The present value, (size,); advances the process by one period."""
        value = self._value
        self._value = self._decay * value + self._kick * np.array(self._normals.take(self._size))
        return value
