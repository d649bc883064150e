"""Kalman filter of an integrator chain that is corrected by late measurements."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
import numpy as np

from ibvs_qp.symbolic.logic import Number, both, where
from ibvs_qp.symbolic.signals import Signals

#: Longest time between two corrections over which the covariance grows [s].
LONGEST_GROWTH = 1.0


class LateKalman:
    r"""Kalman filter of :math:`\dot x = G x + g(t)` with :math:`G^3 = 0`, corrected at past times.

    Because G is nilpotent, a correction dx at the capture has become :math:`dx + t_1 G dx + t_2 G^2 dx` a time t later,
    with :math:`t_1 = t,\ t_2 = t^2/2`, and over ticks of lengths h :math:`t_1 = \sum h_i,\ t_2 = \sum_{i<j} h_i h_j`:
    exact, without replaying the inputs (Larsen et al., 1998, on fusing delayed measurements). The covariance is that of
    the last capture; the caller keeps the state. An entry is its index, or a vector with a one at its place.

    Attributes:
        noise: Power spectral densities of the process noise [unit^2/s], (n,).
        covariance: Of the state at the last capture, (n, n).

    Args:
        signals: Registry.
        name: Of the filter's states.
        chain: G, (n, n).
        initial_std: Standard deviations at the start, (n,).
        elapsed: Time since the last call [s].
    """

    def __init__(
        self, signals: Signals, name: str, chain: ca.SX | np.ndarray, initial_std: Sequence[float], elapsed: ca.SX
    ) -> None:
        self._size, self._signals, self._name, self._chain = len(initial_std), signals, name, ca.SX(chain)
        self.noise: Sequence[Number] = [0.0] * self._size
        lower = ca.Sparsity.lower(self._size)
        start = ca.DM(np.diag(np.square(initial_std)))[lower].nonzeros()
        self.covariance = ca.tril2symm(ca.SX(lower, signals.state(f"{name}.covariance", lower.nnz(), start)))
        self._started, age = signals.state(f"{name}.corrected"), signals.state(f"{name}.covariance_age")
        self._age = where(self._started, age + elapsed, 0.0)

    def _row(self, entry: int | ca.SX) -> ca.SX | ca.DM:
        return ca.DM.eye(self._size)[:, entry] if isinstance(entry, int) else entry

    def variance(self, index: int) -> ca.SX:
        """Variance of one entry now, with its own process noise since the last correction."""
        return self.covariance[index, index] + ca.fmin(self._age, LONGEST_GROWTH) * self.noise[index]

    def variance_of(self, entry: int | ca.SX) -> ca.SX:
        """Variance of one entry at the last capture."""
        row = self._row(entry)
        return ca.dot(row, self.covariance @ row)

    def _set(self, covariance: ca.SX) -> None:
        self.covariance = ca.tril2symm(ca.tril(covariance))

    def go_to(self, condition: ca.SX, age: ca.SX) -> None:
        """Propagate the covariance to a time ``age`` [s] ago, if a condition holds and that is later."""
        dt = where(both(condition, self._started), ca.fmax(ca.fmin(self._age - age, LONGEST_GROWTH), 0.0), 0.0)

        def moved(matrix: ca.SX) -> ca.SX:
            return matrix + self._chain @ (dt * matrix + 0.5 * dt * dt * (self._chain @ matrix))

        self._set(moved(moved(self.covariance).T) + dt * ca.diag(ca.vertcat(*self.noise)))
        self._age = where(condition, where(self._started, ca.fmin(self._age, age), age), self._age)
        self._started = where(condition, 1.0, self._started)

    def within(self, entry: int | ca.SX, innovation: ca.SX, variance: Number, gate: float) -> ca.SX:
        """Whether an innovation lies within so many standard deviations."""
        return innovation**2 <= gate**2 * (self.variance_of(entry) + variance)

    def correct(self, condition: ca.SX, entry: int | ca.SX, innovation: ca.SX, variance: Number) -> ca.SX:
        """Correct with an innovation of one entry; the change of the state at the capture, (n,)."""
        row = self._row(entry)
        column = self.covariance @ row
        weight = where(condition, 1.0 / (ca.dot(row, column) + variance), 0.0)
        self._set(self.covariance - weight * column @ column.T)
        return weight * innovation * column

    def correct_first_two(
        self, condition: ca.SX, innovation: ca.SX, covariance: ca.SX, gate: float
    ) -> tuple[ca.SX, ca.SX]:
        """Correct with innovations of the first two entries, (2,), and their covariance, (2, 2).

        ``gate`` bounds their Mahalanobis distance over the square root of two.

        Returns:
            Whether they are within the gate, and the change of the state at the capture, (n,).
        """
        columns = self.covariance[:, :2]
        (a, b), (_, c) = (ca.horzsplit(row) for row in ca.vertsplit(columns[:2, :] + covariance))
        weight = ca.blockcat([[c, -b], [-b, a]]) / (a * c - b * b)
        accepted = both(condition, ca.bilin(weight, innovation, innovation) <= 2.0 * gate**2)
        gain = columns @ where(accepted, weight, 0.0)
        self._set(self.covariance - gain @ columns.T)
        return accepted, gain @ innovation

    def growth(self, change: ca.SX) -> tuple[ca.SX, ca.SX]:
        """G dx and G^2 dx of a change dx, (n,) each."""
        first = self._chain @ change
        return first, self._chain @ first

    def set_entry(self, condition: ca.SX, entry: int | ca.SX, std: Number) -> None:
        """Standard deviation of an entry that is set, uncorrelated with the others."""
        chosen = condition * self._row(entry)
        keep = 1.0 - ca.densify(chosen)
        self._set(self.covariance * (keep @ keep.T) + std * std * ca.diag(chosen))

    def raise_variance(self, entry: ca.SX, least: ca.SX) -> None:
        """Variance of an entry to a least one."""
        more = ca.fmax(least - self.variance_of(entry), 0.0)
        self._set(self.covariance + more * ca.diag(entry))

    def restart(self, condition: ca.SX, std: Sequence[float]) -> None:
        """Uncorrelated entries with these standard deviations."""
        self.covariance = where(condition, ca.SX(ca.DM(np.diag(np.square(std)))), self.covariance)

    def store(self) -> None:
        """Remember covariance and its time for the next call."""
        self._signals.remember(f"{self._name}.covariance", ca.tril(self.covariance).nz[:])
        self._signals.remember(f"{self._name}.covariance_age", self._age)
        self._signals.remember(f"{self._name}.corrected", self._started)
