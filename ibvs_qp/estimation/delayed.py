"""Kalman filter for measurements that arrive late: predict every tick, correct at the time of capture."""

from __future__ import annotations

import struct
from collections.abc import Sequence

import numpy as np

from ibvs_qp.bound_function import BoundFunction
from ibvs_qp.estimation.propagation import propagation
from ibvs_qp.estimation.stamps import HISTORY, StampRing
from ibvs_qp.machine_code import machine_code

#: Innovations beyond this many standard deviations are refused.
GATE = 6.0
#: A tick that differs from the nominal one by more than this is counted as it was [s].
UNEVEN_S = 1e-9
_put_four = struct.Struct("4d").pack_into
#: Rows (1, j, j (j - 1) / 2): what a correction, its first and its second integral have become j ticks later.
_PATHS = np.array([(1.0, j, 0.5 * j * (j - 1.0)) for j in range(HISTORY)])


class DelayedKalman:
    r"""Integrator chain :math:`\dot x = G x + g(t)` with :math:`G^3 = 0`, corrected at past stamps.

    The tick that a stamp belongs to is found by time, and where ticks differ in length their own lengths count.
    Because G is nilpotent, a correction dx at the capture time reaches j ticks later as
    :math:`dx + j h G dx + \tfrac12 j (j-1) h^2 G^2 dx`: exact, and one small vector product for the whole history,
    instead of replaying the inputs (Larsen et al., 1998, on fusing delayed measurements). The covariance lives
    on the timeline of the captures, so nothing but the state is touched per tick.
    """

    def __init__(
        self,
        chain: np.ndarray,
        noise: np.ndarray,
        initial_std: np.ndarray,
        tick_s: float,
        pattern: np.ndarray | None = None,
        to_machine_code: bool = False,
    ) -> None:
        """Set up the filter.

        Args:
            chain: G, (n, n), nilpotent of degree 3.
            noise: Power spectral densities of the process noise, (n,) [unit^2/s].
            initial_std: Standard deviations at the start, (n,).
            tick_s: Control period [s].
            pattern: Where the chain may have entries, (n, n) bool; None: where it has now.
            to_machine_code: Whether a C compiler translates the propagation; the same bits, sooner.
        """
        self.chain = np.array(chain, float)
        self.noise = np.array(noise, float)
        self.initial_std = np.array(initial_std, float)
        size = len(self.noise)
        self.covariance, self._product, self._time = np.zeros((size, size)), np.zeros((size, size)), np.zeros(1)
        function = propagation(size, (self.chain != 0.0 if pattern is None else np.asarray(pattern, bool)).tobytes())
        self._propagated = BoundFunction(
            machine_code(function) if to_machine_code else function,
            (self.chain, self.covariance, self.noise, self._time),
            (self._product,),
        )
        self.tick = tick_s
        self.ticks = StampRing(tick_s)
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        size = len(self.noise)
        self.covariance[:] = np.diag(self.initial_std**2)
        self._history = np.zeros((HISTORY, size))
        row = struct.Struct(f"{size}d")
        self._put, self._row_bytes, self._bytes = row.pack_into, row.size, self._history.data
        # A correction, its first and its second integral.
        self._terms = np.zeros((3, size))
        self._correction, self._first, self._second = self._terms
        self._pair, self._gain = np.zeros((2, 2)), np.zeros((2, size))
        self._pair_bytes = self._pair.data
        self.ticks.reset()
        self._lengths = [self.tick] * HISTORY
        self._uneven = 0
        self._covariance_stamp = -1

    @property
    def state(self) -> np.ndarray:
        """The state now, (n,): the newest entry of the history itself."""
        return self._history[self.ticks.now % HISTORY]

    def predict(self, stamp_ns: int, increment: np.ndarray, dt: float) -> None:
        """Advance the state by one tick: x += dt G x + increment, and remember it."""
        self.remember(stamp_ns, self.state + dt * (self.chain @ self.state) + increment, dt)

    def remember(self, stamp_ns: int, state: Sequence[float] | np.ndarray, dt: float | None = None) -> None:
        """Take a state that was advanced by one tick elsewhere; by ``dt`` [s], None for the nominal tick."""
        slot = self.ticks.add(stamp_ns)
        self._put(self._bytes, slot * self._row_bytes, *state)
        self._lengths[slot] = self.tick if dt is None else dt
        if dt is not None and abs(dt - self.tick) > UNEVEN_S:
            self._uneven = self.ticks.now

    def set_entry(self, index: int, value: float, std: float) -> None:
        """Set one state entry now and in the past, uncorrelated with the rest (a new line, a first distance)."""
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
        self.set_entry(index, value, std)
        self._history[:, index] += path

    def at(self, stamp_ns: int) -> np.ndarray | None:
        """State remembered for a stamp (the nearest tick), None if it is not in the history."""
        age = self.ticks.age(stamp_ns)
        return None if age is None else self._past(age)

    def correct(
        self, stamp_ns: int, rows: np.ndarray, values: np.ndarray, covariance: np.ndarray, gate: float = GATE
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
        age = self._go_to(stamp_ns)
        if age is None:
            return False
        past = self._past(age)
        innovation = values - rows @ past
        if len(innovation) == 1:
            return self._take(age, self.covariance @ rows[0], rows[0], innovation.item(), covariance.item(0), gate)
        spread = rows @ self.covariance @ rows.T + covariance
        gain = np.linalg.solve(spread, rows @ self.covariance).T
        if innovation @ np.linalg.solve(spread, innovation) > gate * gate * len(values):
            return False
        self.covariance -= gain @ rows @ self.covariance
        self.covariance[:] = 0.5 * (self.covariance + self.covariance.T)
        self._apply(gain @ innovation, age)
        return True

    def correct_entry(self, stamp_ns: int, index: int, value: float, variance: float, gate: float = GATE) -> bool:
        """The same for one measured entry of the state, a scalar: divisions where many values need linear systems."""
        age = self._go_to(stamp_ns)
        if age is None:
            return False
        past = self._past(age)
        known = self.covariance[:, index].copy()
        return self._take(age, known, index, value - past.item(index), variance, gate)

    def correct_pair(
        self, stamp_ns: int, first: int, values: tuple[float, float], covariance: tuple[float, float, float]
    ) -> bool:
        """The same for two neighbouring entries at once, with the covariance's entries (1,1), (1,2), (2,2)."""
        age = self._go_to(stamp_ns)
        if age is None:
            return False
        past = self._past(age)
        p = self.covariance
        da, db = values[0] - past.item(first), values[1] - past.item(first + 1)
        aa = p.item(first, first) + covariance[0]
        ab = p.item(first, first + 1) + covariance[1]
        bb = p.item(first + 1, first + 1) + covariance[2]
        determinant = aa * bb - ab * ab
        wa, wb = (bb * da - ab * db) / determinant, (aa * db - ab * da) / determinant
        if da * wa + db * wb > 2.0 * GATE * GATE:
            return False
        # Rows for columns: P is symmetric, but for the rounding here, which the next propagation mends.
        known, gain = p[first : first + 2], self._gain
        _put_four(self._pair_bytes, 0, bb / determinant, -ab / determinant, -ab / determinant, aa / determinant)
        np.dot(self._pair, known, out=gain)
        correction = da * gain[0]
        correction += db * gain[1]
        np.dot(known.T, gain, out=self._product)
        p -= self._product
        self._apply(correction, age)
        return True

    def _past(self, age: int) -> np.ndarray:
        return self._history[self.ticks.slot(age)]

    def _go_to(self, stamp_ns: int) -> int | None:
        """Bring the covariance to a stamp; its age in ticks, None if it is forgotten."""
        age = self.ticks.age(stamp_ns)
        if age is None:
            return None
        if self._covariance_stamp >= 0:
            dt = max(0.0, (stamp_ns - self._covariance_stamp) * 1e-9)
            if dt > 0.0:
                self._propagate(min(dt, 1.0))
        self._covariance_stamp = max(stamp_ns, self._covariance_stamp)
        return age

    def _take(
        self, age: int, known: np.ndarray, row: np.ndarray | int, innovation: float, variance: float, gate: float
    ) -> bool:
        """One scalar measurement: ``known`` = P h, where h is the row, or the row of one entry given by its index."""
        spread = (known.item(row) if isinstance(row, int) else float(row @ known)) + variance
        if innovation * innovation > gate * gate * spread:
            return False
        self._shrink(known, spread)
        self._apply(known * (innovation / spread), age)
        return True

    def _shrink(self, known: np.ndarray, spread: float) -> None:
        """P - known known' / spread, symmetric to the bit."""
        product = self._product
        np.multiply(known[:, None], known, out=product)
        product /= spread
        self.covariance -= product

    def _propagate(self, dt: float) -> None:
        self._time[0] = dt
        self._propagated()
        self.covariance[:] = self._product

    def _apply(self, correction: np.ndarray, age: int) -> None:
        """Add a correction at a past tick and what has become of it since."""
        chain, tick, first, second = self.chain, self.tick, self._first, self._second
        self._correction[:] = correction
        np.dot(chain, correction, out=first)
        first *= tick
        np.dot(chain, first, out=second)
        second *= tick
        path = self._paths(age).dot(self._terms)
        start, end = self.ticks.slot(age), self.ticks.slot(0) + 1
        if start < end:
            self._history[start:end] += path
        else:
            self._history[start:] += path[: HISTORY - start]
            self._history[:end] += path[HISTORY - start :]

    def _paths(self, age: int) -> np.ndarray:
        """`_PATHS` of the last ticks, (age + 1, 3), in units of the nominal tick where they had other lengths."""
        if self.ticks.now - age >= self._uneven:
            return _PATHS[: age + 1]
        lengths = np.array([self._lengths[self.ticks.slot(back)] for back in range(age - 1, -1, -1)]) / self.tick
        once = np.concatenate(([0.0], np.cumsum(lengths)))
        return np.column_stack((np.ones(age + 1), once, np.concatenate(([0.0], np.cumsum(lengths * once[:-1])))))
