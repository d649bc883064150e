"""Errors between the commanded and the true thrust of every rotor."""

from __future__ import annotations

import numpy as np

from sim.world.errors import RotorErrors
from sim.world.random_streams import Normals, stream
from sim.world.slow_noise import SlowNoise

_S_PER_MIN = 60.0


class ThrustFactors:
    """True over commanded thrust of every rotor: gain, spread, sagging battery, noise.

    Args:
        errors: Sizes.
        rotors: Number of rotors.
        tick_s: Time between calls of `next` [s].
        seed: Seed of the flight.
    """

    def __init__(self, errors: RotorErrors, rotors: int, tick_s: float, seed: int) -> None:
        normals = Normals(stream(seed, "errors.rotors"))
        self._constant = (1.0 + errors.gain) * (1.0 + errors.spread * np.array(normals.take(rotors)))
        self._noise = SlowNoise(errors.noise, errors.noise_time_s, tick_s, normals, rotors)
        self._loss = errors.sag_per_min * tick_s / _S_PER_MIN
        self._ticks = 0

    def next(self) -> np.ndarray:
        """Factors of the next tick, (n,), >= 0."""
        left = 1.0 - self._loss * self._ticks
        self._ticks += 1
        return np.maximum(left * self._constant * (1.0 + self._noise.next()), 0.0)
