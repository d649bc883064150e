"""Kalman filter for measurements that arrive late: predict every tick, correct at the time of capture."""

from __future__ import annotations

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
        self.chain, self._noise = np.array(chain, float), np.diag(noise)
        self._initial, self._gate = np.diag(np.square(initial_std)), gate_sigmas
        self.ticks = StampRing(tick_s)
        self.reset()

    def reset(self) -> None:
        """Return to the state before the first tick."""
        self.covariance = self._initial.copy()
        self._history, self._lengths = np.zeros((HISTORY, len(self._noise))), np.zeros(HISTORY)
        self.ticks.reset()
        self._covariance_stamp = -1

    @property
    def state(self) -> np.ndarray:
        """The state now, (n,): the newest entry of the history itself."""
        return self._history[self.ticks.now % HISTORY]

    def predict(self, stamp_ns: int, increment: np.ndarray, dt: float) -> None:
        """Advance the state by one tick: x += dt G x + increment."""
        self.remember(stamp_ns, self.state + dt * (self.chain @ self.state) + increment, dt)

    def remember(self, stamp_ns: int, state: Sequence[float] | np.ndarray, dt: float) -> None:
        """Store a state that the caller has advanced by one tick of ``dt`` [s]."""
        slot = self.ticks.add(stamp_ns)
        self._history[slot] = state
        self._lengths[slot] = dt

    def at(self, stamp_ns: int) -> np.ndarray | None:
        """State at the tick nearest to a stamp, (n,): the history itself; None if it is not remembered."""
        age = self.ticks.age(stamp_ns)
        return None if age is None else self._history[self.ticks.slot(age)]

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
        path = np.zeros(HISTORY) if past is None else (self._history - past) @ rates
        self.set_entry(index, value, std)
        self._history[:, index] += path

    def correct(
        self,
        stamp_ns: int,
        entries: Sequence[int],
        values: Sequence[float] | np.ndarray,
        covariance: np.ndarray,
        gate: float | None = None,
    ) -> bool:
        """Correct with measured entries of the state.

        Args:
            stamp_ns: Time of capture.
            entries: Indices of the k measured entries.
            values: Measured values, (k,).
            covariance: Of the values, (k, k).
            gate: Innovations beyond this many standard deviations are refused; None: the filter's own.

        Returns:
            False if the stamp is not in the history or the innovation is beyond the gate.
        """
        past = self._past(stamp_ns)
        if past is None:
            return False
        columns, innovation = self.covariance[:, entries], values - past[list(entries)]
        weight = np.linalg.inv(columns[list(entries)] + covariance)
        if innovation @ weight @ innovation > (gate or self._gate) ** 2 * len(innovation):
            return False
        gain = columns @ weight
        self._apply(stamp_ns, gain @ innovation, _symmetric(gain @ columns.T))
        return True

    def correct_entry(
        self, stamp_ns: int, index: int, value: float, variance: float, gate: float | None = None
    ) -> bool:
        """`correct` for one entry."""
        past = self._past(stamp_ns)
        if past is None:
            return False
        column = self.covariance[:, index]
        innovation, spread = value - past[index], column[index] + variance
        if innovation * innovation > (gate or self._gate) ** 2 * spread:
            return False
        self._apply(stamp_ns, innovation / spread * column, np.outer(column, column) / spread)
        return True

    def _past(self, stamp_ns: int) -> np.ndarray | None:
        """State at a stamp, with the covariance propagated to it; None if it is not remembered."""
        past = self.at(stamp_ns)
        if past is None:
            return None
        if 0 <= self._covariance_stamp < stamp_ns:
            dt = min((stamp_ns - self._covariance_stamp) * 1e-9, LONGEST_GROWTH)
            step = dt * self.chain
            transition = np.eye(len(step)) + step + 0.5 * step @ step
            self.covariance = _symmetric(transition @ self.covariance @ transition.T) + dt * self._noise
        self._covariance_stamp = max(stamp_ns, self._covariance_stamp)
        return past

    def _apply(self, stamp_ns: int, correction: np.ndarray, reduction: np.ndarray) -> None:
        """Add a correction of the past state to every state since, and reduce the covariance."""
        self.covariance = self.covariance - reduction
        slots = self.ticks.slots_since(stamp_ns)
        lengths = self._lengths[slots[1:]]
        once = np.concatenate(([0.0], np.cumsum(lengths)))
        twice = np.concatenate(([0.0], np.cumsum(lengths * once[:-1])))
        first = self.chain @ correction
        self._history[slots] += correction + np.outer(once, first) + np.outer(twice, self.chain @ first)


def _symmetric(matrix: np.ndarray) -> np.ndarray:
    return 0.5 * (matrix + matrix.T)
