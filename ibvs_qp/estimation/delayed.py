"""Kalman filter for measurements that arrive late: predict every tick, correct at the time of capture."""

from __future__ import annotations

import numpy as np

#: Ticks of history kept; at 250 Hz half a second, far beyond any camera's latency.
HISTORY = 128


class DelayedKalman:
    r"""Integrator chain :math:`\dot x = G x + g(t)` with :math:`G^3 = 0`, corrected at past stamps.

    Because G is nilpotent, a correction dx at the capture time reaches j ticks later as
    :math:`dx + j h G dx + \tfrac12 j (j-1) h^2 G^2 dx`: exact, and one small vector product for the whole history,
    instead of replaying the inputs (Larsen et al., 1998, on fusing delayed measurements). The covariance lives
    on the timeline of the captures, so nothing but the state is touched per tick.
    """

    def __init__(self, chain: np.ndarray, noise: np.ndarray, initial_std: np.ndarray, tick_s: float) -> None:
        """Set up the filter.

        Args:
            chain: G, (n, n), nilpotent of degree 3.
            noise: Power spectral densities of the process noise, (n,) [unit^2/s].
            initial_std: Standard deviations at the start, (n,).
            tick_s: Control period [s].
        """
        self.chain = np.array(chain, float)
        self.noise = np.array(noise, float)
        self.initial_std = np.array(initial_std, float)
        self.tick = tick_s
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        size = len(self.noise)
        self.state = np.zeros(size)
        self.covariance = np.diag(self.initial_std**2)
        self._history = np.zeros((HISTORY, size))
        self._stamps = np.full(HISTORY, -1, dtype=np.int64)
        self._now = 0
        self._covariance_stamp = -1

    def predict(self, stamp_ns: int, increment: np.ndarray, dt: float) -> None:
        """Advance the state by one tick: x += dt G x + increment, and remember it."""
        self.remember(stamp_ns, self.state + dt * (self.chain @ self.state) + increment)

    def remember(self, stamp_ns: int, state: np.ndarray) -> None:
        """Take a state that was advanced by one tick elsewhere."""
        self.state = state
        self._now += 1
        slot = self._now % HISTORY
        self._history[slot] = self.state
        self._stamps[slot] = stamp_ns

    def set_entry(self, index: int, value: float, std: float) -> None:
        """Set one state entry now and in the past, uncorrelated with the rest (a new line, a first distance)."""
        self.state[index] = value
        self._history[:, index] = value
        self.covariance[index, :] = 0.0
        self.covariance[:, index] = 0.0
        self.covariance[index, index] = std * std

    def set_path(self, index: int, value: float, stamp_ns: int, rates: np.ndarray, std: float) -> None:
        """Set one entry at a past stamp and, where it differs, along the remembered motion of the other entries.

        Args:
            index: The entry.
            value: Its value at the stamp.
            stamp_ns: Time of capture.
            rates: Entry per unit of the others, (n,): it moved by ``rates @ (x(t) - x(stamp))``.
            std: Standard deviation.
        """
        past = self.at(stamp_ns)
        path = np.zeros(HISTORY) if past is None else (self._history - past) @ rates
        now = 0.0 if past is None else float((self.state - past) @ rates)
        self.set_entry(index, value + now, std)
        self._history[:, index] = value + path

    def at(self, stamp_ns: int) -> np.ndarray | None:
        """State remembered for a stamp (the nearest tick), None if it is not in the history."""
        age = self._age(stamp_ns)
        return None if age is None else self._history[(self._now - age) % HISTORY]

    def _age(self, stamp_ns: int) -> int | None:
        newest = self._stamps[self._now % HISTORY]
        age = round((newest - stamp_ns) * 1e-9 / self.tick)
        if newest < 0 or age < -1 or age >= min(HISTORY, self._now):
            return None
        return max(0, age)

    def correct(
        self, stamp_ns: int, rows: np.ndarray, values: np.ndarray, covariance: np.ndarray, gate: float = 6.0
    ) -> bool:
        """Correct with measurements ``values = rows @ x(stamp) + noise``.

        Args:
            stamp_ns: Time of capture.
            rows: Measurement matrix, (k, n).
            values: Measured values, (k,).
            covariance: Of the values, (k, k).
            gate: Innovations beyond this many standard deviations are refused.

        Returns:
            False if the stamp is not in the history or the innovation is beyond the gate.
        """
        age = self._age(stamp_ns)
        if age is None:
            return False
        if self._covariance_stamp >= 0:
            dt = max(0.0, (stamp_ns - self._covariance_stamp) * 1e-9)
            if dt > 0.0:
                self._propagate(min(dt, 1.0))
        self._covariance_stamp = max(stamp_ns, self._covariance_stamp)
        past = self._history[(self._now - age) % HISTORY]
        innovation = values - rows @ past
        if len(innovation) == 1:
            return self._correct_one(rows[0], float(innovation[0]), float(covariance[0, 0]), gate, age)
        spread = rows @ self.covariance @ rows.T + covariance
        gain = np.linalg.solve(spread, rows @ self.covariance).T
        if innovation @ np.linalg.solve(spread, innovation) > gate * gate * len(values):
            return False
        self.covariance = self.covariance - gain @ rows @ self.covariance
        self.covariance = 0.5 * (self.covariance + self.covariance.T)
        self._apply(gain @ innovation, age)
        return True

    def _correct_one(self, row: np.ndarray, innovation: float, variance: float, gate: float, age: int) -> bool:
        """The same for a single value: a division where many values need a linear system."""
        known = self.covariance @ row
        spread = float(row @ known) + variance
        if innovation * innovation > gate * gate * spread:
            return False
        self.covariance = self.covariance - np.outer(known, known) / spread
        self._apply(known * (innovation / spread), age)
        return True

    def _propagate(self, dt: float) -> None:
        step = np.eye(len(self.noise)) + dt * self.chain + 0.5 * dt * dt * (self.chain @ self.chain)
        moved = step @ self.covariance @ step.T + np.diag(self.noise * dt)
        self.covariance = 0.5 * (moved + moved.T)

    def _apply(self, correction: np.ndarray, age: int) -> None:
        first = self.chain @ correction * self.tick
        second = self.chain @ first * self.tick
        steps = np.arange(age + 1.0)[:, None]
        path = correction + steps * first + 0.5 * steps * (steps - 1.0) * second
        slots = (self._now - age + np.arange(age + 1)) % HISTORY
        self._history[slots] += path
        self.state = self._history[self._now % HISTORY].copy()
