"""Vibration of the airframe at the rotors' frequencies, as an IMU samples it."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

#: Frequency at which blades pass a point while the vehicle hovers [Hz]. Thrust T = C_T rho n^2 D^4 of an 18 inch
#: propeller (D = 0.457 m) with C_T = 0.1 is 10 N, a sixth of 6 kg, at n = 43 turns per second; two blades pass at 2 n.
BLADE_HZ = 85.0
#: Propellers of one batch differ: at equal thrust, their frequencies spread evenly over plus and minus this (assumed).
BLADE_SPREAD = 0.03


class Vibration:
    """One line per rotor on every axis: its frequency follows the root of the thrust, its amplitude the thrust.

    The phase integrates at every control tick and the sensor reads it at its samples, so that lines beyond half the
    sample rate alias. Phases at the start and the mix of the rotors on every axis are random. While the vehicle
    hovers, every axis has the stated size (rms).

    Attributes:
        value: Reading at the present tick, in the units of the sizes, (n,).

    Args:
        sizes: Size of every axis, rms.
        rng: Source of phases, mix and spread.
    """

    def __init__(self, sizes: Sequence[float], rng: np.random.Generator) -> None:
        self._sizes, self._rng = np.array(sizes), rng
        self.value = np.zeros(len(sizes))
        self._mix, self._rates, self._phases = np.zeros((0, 0), complex), np.zeros(0), np.zeros(0)
        self._hover, self._then_ns = 0.0, 0

    def tick(self, now_ns: int, thrusts: np.ndarray) -> None:
        """Advance to a tick; the first one defines the thrust of hovering.

        Args:
            now_ns: Time of the tick.
            thrusts: Actual thrusts [N], (n,).
        """
        if not self._hover:
            self._start(thrusts)
        load = thrusts / self._hover
        self._phases += self._rates * np.sqrt(load) * (1e-9 * (now_ns - self._then_ns))
        self._then_ns = now_ns
        self.value = (self._mix @ (load * np.exp(1j * self._phases))).real

    def _start(self, thrusts: np.ndarray) -> None:
        count, rng = len(thrusts), self._rng
        self._hover = float(thrusts.mean())
        spread = rng.permutation(np.linspace(-BLADE_SPREAD, BLADE_SPREAD, count))
        self._rates, self._phases = 2.0 * math.pi * BLADE_HZ * (1.0 + spread), np.zeros(count)
        axes = len(self._sizes)
        mix = rng.uniform(0.5, 1.5, (axes, count)) * np.exp(1j * rng.uniform(0.0, 2.0 * math.pi, (axes, count)))
        power = 0.5 * np.sum(np.abs(mix) ** 2, axis=1, keepdims=True)
        self._mix = self._sizes[:, None] * mix / np.sqrt(power)
