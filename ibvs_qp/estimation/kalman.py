"""Kalman filter for measurements that arrive late: predict every tick, correct at the time of capture."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ibvs_qp.estimation.stamps import HISTORY, StampRing

#: Longest time between two corrections over which the covariance grows [s].
LONGEST_GROWTH = 1.0


class DelayedKalman:
    r"""Integrator chain :math:`\dot x = G x + g(t)` with :math:`G^3 = 0`, corrected at past stamps.

    Because G is nilpotent, a correction dx at the capture time has become
    :math:`dx + t G dx + \tfrac12 t^2 G^2 dx` a time t later: exact, and one small product for the whole history,
    instead of replaying the inputs (Larsen et al., 1998, on fusing delayed measurements). Over discrete ticks of
    lengths h the two factors are :math:`\sum h_i` and :math:`\sum_{i<j} h_i h_j`. The covariance is that of the last
    capture; a tick only touches the state.

    Attributes:
        chain: G, (n, n); may be written.
        covariance: Of the state at the stamp of the last correction, (n, n); may be written.
        noise: Power spectral densities of the process noise on the diagonal, (n, n) [unit^2/s]; may be written.
        ticks: Stamps of the ticks remembered.
    """

    def __init__(
        self, chain: np.ndarray, noise: np.ndarray, initial_std: np.ndarray, tick_s: float, gate_sigmas: float
    ) -> None:
        """Set up the filter.

        Args:
            chain: G, (n, n), nilpotent of degree 3.
            noise: Power spectral densities of the process noise, (n,) [unit^2/s].
            initial_std: Standard deviations at the start, (n,).
            tick_s: Nominal control period [s].
            gate_sigmas: Innovations beyond this many standard deviations are refused.
        """
        self.chain, self.noise = np.array(chain, float), np.diag(noise)
        self._identity = np.eye(len(chain))
        self._initial, self._gate = np.diag(np.square(initial_std)), gate_sigmas
        self.ticks = StampRing(tick_s)
        self.reset()

    def reset(self) -> None:
        """Return to the state before the first tick."""
        self.covariance = self._initial.copy()
        # Twice as long as needed: a full buffer moves its newest half to the front, so that history is one slice.
        self._history, self._lengths, self._newest = np.zeros((2 * HISTORY, len(self.noise))), np.zeros(2 * HISTORY), 0
        self.ticks.reset()
        self._covariance_stamp, self._capture = -1, None

    @property
    def state(self) -> np.ndarray:
        """The state now, (n,): the newest entry of the history itself."""
        return self._history[self._newest]

    def remember(self, stamp_ns: int, state: Sequence[float] | np.ndarray, dt: float) -> None:
        """Store a state that the caller has advanced by one tick of ``dt`` [s]."""
        self.ticks.add(stamp_ns)
        self._capture = None
        if self._newest == 2 * HISTORY - 1:
            self._history[:HISTORY], self._lengths[:HISTORY] = self._history[HISTORY:], self._lengths[HISTORY:]
            self._newest = HISTORY - 1
        self._newest += 1
        self._history[self._newest] = state
        self._lengths[self._newest] = dt

    def at(self, stamp_ns: int) -> np.ndarray | None:
        """State at the tick nearest to a stamp, (n,): the history itself; None if it is not remembered."""
        age = self.ticks.age(stamp_ns)
        return None if age is None else self._history[self._newest - age]

    def variance(self, index: int, stamp_ns: int) -> float:
        """Variance of one entry at a stamp after the last correction, with its own process noise."""
        since = (stamp_ns - self._covariance_stamp) * 1e-9 if self._covariance_stamp >= 0 else 0.0
        return self.covariance.item(index, index) + min(since, LONGEST_GROWTH) * self.noise.item(index, index)

    def restart(self) -> None:
        """Covariance of the start, so that no gate refuses the next measurements; the state stays."""
        self.covariance = self._initial.copy()

    def set_entry(self, index: int, value: float, std: float) -> None:
        """Set one state entry now and in the past, uncorrelated with the rest (a new line, a first distance)."""
        self._history[:, index] = value
        self.covariance[index, :] = self.covariance[:, index] = 0.0
        self.covariance[index, index] = std * std

    def set_path(self, index: int, value: float, stamp_ns: int, rates: np.ndarray, std: float) -> None:
        """Set one entry at a past stamp, and along the remembered motion of the other entries where it differs.

        Args:
            index: The entry.
            value: Its value at the stamp.
            stamp_ns: Time of capture.
            rates: Entry per unit of the others, (n,): it moved by ``rates @ (x(t) - x(stamp))``.
            std: Standard deviation.
        """
        past = self.at(stamp_ns)
        path = 0.0 if past is None else (self._history - past) @ rates
        self.set_entry(index, value, std)
        self._history[:, index] += path

    def correct_entry(
        self, stamp_ns: int, index: int, value: float, variance: float, gate: float | None = None
    ) -> bool:
        """Correct with one measured entry of the state.

        Args:
            stamp_ns: Time of capture.
            index: The entry.
            value: Its measured value.
            variance: Of the value.
            gate: Innovations beyond this many standard deviations are refused; None: the filter's own.

        Returns:
            False if the stamp is not in the history or the innovation is beyond the gate.
        """
        capture = self._go_to(stamp_ns)
        if capture is None:
            return False
        column = self.covariance[:, index]
        innovation, spread = value - capture.states[0, index], column[index] + variance
        if innovation * innovation > (gate or self._gate) ** 2 * spread:
            return False
        scaled = column / math.sqrt(spread)
        self._apply(capture, innovation / spread * column, scaled[:, None] * scaled)
        return True

    def correct_pair(
        self, stamp_ns: int, first: int, values: np.ndarray, covariance: np.ndarray, gate: float | None = None
    ) -> bool:
        """Correct with two neighbouring entries, as `correct_entry`.

        Args:
            stamp_ns: Time of capture.
            first: Index of the first one.
            values: Measured values, (2,).
            covariance: Of the values, (2, 2).
            gate: As in `correct_entry`, for the innovation's Mahalanobis distance over the square root of two.
        """
        capture = self._go_to(stamp_ns)
        if capture is None:
            return False
        both = slice(first, first + 2)
        columns, innovation = self.covariance[:, both], values - capture.states[0, both]
        (a, b), (_, c) = (columns[both] + covariance).tolist()
        weight = np.array(((c, -b), (-b, a))) / (a * c - b * b)
        if innovation @ weight @ innovation > 2.0 * (gate or self._gate) ** 2:
            return False
        gain = columns @ weight
        self._apply(capture, gain @ innovation, gain @ columns.T)
        return True

    def _go_to(self, stamp_ns: int) -> _Capture | None:
        """Propagate the covariance to a stamp; None if the stamp is not remembered."""
        if self._capture is None or self._capture.stamp_ns != stamp_ns:
            age = self.ticks.age(stamp_ns)
            if age is None:
                return None
            past, newest = self._newest - age, self._newest
            self._capture = _Capture(stamp_ns, self._history[past : newest + 1], self._lengths[past + 1 : newest + 1])
            self._propagate(stamp_ns)
        return self._capture

    def _propagate(self, stamp_ns: int) -> None:
        if 0 <= self._covariance_stamp < stamp_ns:
            dt = min((stamp_ns - self._covariance_stamp) * 1e-9, LONGEST_GROWTH)
            step = dt * self.chain
            transition = self._identity + step + 0.5 * step @ step
            grown = transition @ self.covariance @ transition.T
            self.covariance = 0.5 * (grown + grown.T) + dt * self.noise
        self._covariance_stamp = max(stamp_ns, self._covariance_stamp)

    def _apply(self, capture: _Capture, correction: np.ndarray, reduction: np.ndarray) -> None:
        """Add a correction of the captured state to every state since, and reduce the covariance."""
        self.covariance -= reduction
        first = self.chain @ correction
        capture.states += capture.growth @ np.array((correction, first, self.chain @ first))


class _Capture:
    """The ticks since a capture.

    Attributes:
        stamp_ns: Time of capture.
        states: States of the captured tick and of every later one, (age + 1, n): a part of the history itself.
        growth: Factors of dx, G dx and G^2 dx at these ticks, (age + 1, 3) [1, s, s^2].
    """

    def __init__(self, stamp_ns: int, states: np.ndarray, lengths: np.ndarray) -> None:
        self.stamp_ns, self.states = stamp_ns, states
        once = twice = 0.0
        factors = [(1.0, once, twice)]
        for length in lengths.tolist():
            once, twice = once + length, twice + length * once
            factors.append((1.0, once, twice))
        self.growth = np.array(factors)
