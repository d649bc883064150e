"""Covariance of an integrator chain that is corrected by late measurements, one tick."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
import numpy as np

from ibvs_qp.symbolic.logic import Number, both, where
from ibvs_qp.symbolic.signals import Signals

#: d/dt (distance, speed, bias) = CHAIN (distance, speed, bias) + measured acceleration.
CHAIN = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [0.0, 0.0, 0.0]])
#: Longest time between two corrections over which the covariance grows [s].
LONGEST_GROWTH = 1.0


class LateKalman:
    r"""Kalman filter of :math:`\dot x = G x + g(t)` with :math:`G^3 = 0`, corrected at past times.

    Because G is nilpotent, a correction dx at the capture has become :math:`dx + t G dx + \tfrac12 t^2 G^2 dx` a time
    t later: exact, without replaying the inputs (Larsen et al., 1998, on fusing delayed measurements). The covariance
    is that of the last capture; the caller keeps the state.

    Attributes:
        noise: Power spectral densities of the process noise [unit^2/s], (3,).

    Args:
        signals: Registry.
        initial_std: Standard deviations at the start, (3,).
        elapsed: Time since the last tick [s].
    """

    def __init__(self, signals: Signals, initial_std: Sequence[float], elapsed: ca.SX) -> None:
        initial = np.diag(np.square(initial_std))
        self._signals = signals
        self.noise: tuple[Number, Number, Number] = (0.0, 0.0, 0.0)
        self._covariance = ca.reshape(signals.state("wall.covariance", 9, initial.ravel().tolist()), 3, 3)
        self._started, age = signals.state("wall.corrected"), signals.state("wall.covariance_age")
        self._age = where(self._started, age + elapsed, 0.0)

    def variance(self, index: int) -> ca.SX:
        """Variance of one entry now, with its own process noise since the last correction."""
        return self._covariance[index, index] + ca.fmin(self._age, LONGEST_GROWTH) * self.noise[index]

    def go_to(self, condition: ca.SX, age: ca.SX) -> None:
        """Propagate the covariance to a time ``age`` [s] ago, if a condition holds."""
        dt = ca.fmin(self._age - age, LONGEST_GROWTH)
        step = dt * ca.DM(CHAIN)
        transition = ca.DM.eye(3) + step + 0.5 * step @ step
        grown = transition @ self._covariance @ transition.T + dt * ca.diag(ca.vertcat(*self.noise))
        later = both(condition, self._started, dt > 0.0)
        self._covariance = where(later, grown, self._covariance)
        self._age = where(condition, where(self._started, ca.fmin(self._age, age), age), self._age)
        self._started = where(condition, 1.0, self._started)

    def within(self, index: int, innovation: ca.SX, variance: Number, gate: float) -> ca.SX:
        """Whether an innovation lies within so many standard deviations."""
        return innovation**2 <= gate**2 * (self._covariance[index, index] + variance)

    def correct(
        self, condition: ca.SX, index: int, innovation: ca.SX, variance: Number, age: ca.SX
    ) -> tuple[ca.SX, ca.SX]:
        """Correct with an innovation of one entry; the changes of the state at the capture and now, (3,) each."""
        column = self._covariance[:, index]
        spread = column[index] + variance
        change = where(condition, innovation / spread * column, ca.SX.zeros(3))
        self._covariance = self._covariance - where(condition, column @ column.T / spread, ca.SX.zeros(3, 3))
        first = ca.DM(CHAIN) @ change
        return change, change + age * first + 0.5 * age**2 * (ca.DM(CHAIN) @ first)

    def set_entry(self, condition: ca.SX, index: int, std: float) -> None:
        """Standard deviation of an entry that is set, uncorrelated with the others."""
        keep = np.ones((3, 3))
        keep[index, :] = keep[:, index] = 0.0
        fresh = self._covariance * ca.DM(keep) + ca.DM(np.diag(np.eye(3)[index] * std * std))
        self._covariance = where(condition, fresh, self._covariance)

    def restart(self, condition: ca.SX, std: Sequence[float]) -> None:
        """Uncorrelated entries with these standard deviations."""
        self._covariance = where(condition, ca.SX(ca.DM(np.diag(np.square(std)))), self._covariance)

    def store(self) -> None:
        """Remember covariance and its time for the next tick."""
        self._signals.remember("wall.covariance", ca.vec(self._covariance))
        self._signals.remember("wall.covariance_age", self._age)
        self._signals.remember("wall.corrected", self._started)
