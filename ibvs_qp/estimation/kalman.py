"""Kalman filter for measurements that arrive late: predict every tick, correct at the time of capture."""

from __future__ import annotations

import struct
from collections.abc import Sequence

import numpy as np

from ibvs_qp.estimation.correction import correction
from ibvs_qp.estimation.propagation import propagation
from ibvs_qp.estimation.stamps import HISTORY, StampRing
from ibvs_qp.model.bound_function import BoundFunction
from ibvs_qp.model.machine_code import machine_code

#: Innovations beyond this many standard deviations are refused.
GATE = 6.0
#: A tick that differs from the nominal one by more than this is counted as it was [s].
UNEVEN_S = 1e-9
_put_six = struct.Struct("6d").pack_into
#: Rows (1, j, j (j - 1) / 2): what a correction, its first and its second integral have become j ticks later.
_PATHS = np.array([(1.0, j, 0.5 * j * (j - 1.0)) for j in range(HISTORY)])


class DelayedKalman:
    r"""Integrator chain :math:`\dot x = G x + g(t)` with :math:`G^3 = 0`, corrected at past stamps.

    The tick that a stamp belongs to is found by time, and where ticks differ in length their own lengths count.
    Because G is nilpotent, a correction dx at the capture time reaches j ticks later as
    :math:`dx + j h G dx + \tfrac12 j (j-1) h^2 G^2 dx`: exact, and one small vector product for the whole history,
    instead of replaying the inputs (Larsen et al., 1998, on fusing delayed measurements). The covariance lives
    on the timeline of the captures, so nothing but the state is touched per tick. What is corrected at one stamp is
    gathered there, and reaches the later ticks in one go when somebody asks for them.

    Attributes:
        chain: G, (n, n), entries only where the pattern allows; may be written.
        covariance: Of the state at the stamp of the last correction, (n, n); may be written.
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
        # Covariance, the past state that is being corrected, and what has been added to it with its integrals.
        self._belief, self._corrected = np.zeros(size * (size + 4)), np.zeros(size * (size + 4))
        parts = self._belief[size * size :].reshape(4, size)
        self.covariance, self._past, self._terms = self._belief[: size * size].reshape(size, size), parts[0], parts[1:]
        self._product, self._time = np.zeros((size, size)), np.zeros(1)
        self._entries, self._measured = np.zeros((2, size)), np.zeros(6)
        known = (self.chain != 0.0 if pattern is None else np.asarray(pattern, bool)).tobytes()
        functions = propagation(size, known), correction(size, known)
        grow, correct = map(machine_code, functions) if to_machine_code else functions
        self._propagated = BoundFunction(grow, (self.chain, self.covariance, self.noise, self._time), (self._product,))
        self._correct = BoundFunction(
            correct, (self.chain, self._belief, self._entries, self._measured), (self._corrected,)
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
        self.ticks.reset()
        self._lengths = [self.tick] * HISTORY
        self._uneven = 0
        self._covariance_stamp = -1
        self._open, self._age = -1, 0  # stamp at which corrections are gathered, and its age in ticks
        self._terms[:] = 0.0

    @property
    def state(self) -> np.ndarray:
        """The state now, (n,): the newest entry of the history itself."""
        if self._open >= 0:
            self._settle()
        return self._history[self.ticks.now % HISTORY]

    def predict(self, stamp_ns: int, increment: np.ndarray, dt: float) -> None:
        """Advance the state by one tick: x += dt G x + increment, and remember it."""
        self.remember(stamp_ns, self.state + dt * (self.chain @ self.state) + increment, dt)

    def remember(self, stamp_ns: int, state: Sequence[float] | np.ndarray, dt: float | None = None) -> None:
        """Take a state that was advanced by one tick elsewhere; by ``dt`` [s], None for the nominal tick."""
        if self._open >= 0:
            self._settle()
        slot = self.ticks.add(stamp_ns)
        self._put(self._bytes, slot * self._row_bytes, *state)
        tick = self.tick
        self._lengths[slot] = dt = tick if dt is None else dt
        if not -UNEVEN_S <= dt - tick <= UNEVEN_S:
            self._uneven = self.ticks.now

    def set_entry(self, index: int, value: float, std: float) -> None:
        """Set one state entry now and in the past, uncorrelated with the rest (a new line, a first distance)."""
        self._settle()
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
        self._settle()
        age = self.ticks.age(stamp_ns)
        return None if age is None else self._history[self.ticks.slot(age)]

    def entry(self, stamp_ns: int, index: int) -> float | None:
        """One entry of `at` as a plain number; between corrections at one stamp this is the short way."""
        if stamp_ns == self._open:
            return self._past.item(index)
        past = self.at(stamp_ns)
        return None if past is None else past.item(index)

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
        if not self._go_to(stamp_ns):
            return False
        innovation = values - rows @ self._past
        spread = rows @ self.covariance @ rows.T + covariance
        gain = np.linalg.solve(spread, rows @ self.covariance).T
        if innovation @ np.linalg.solve(spread, innovation) > gate * gate * len(values):
            return False
        self.covariance -= gain @ rows @ self.covariance
        self.covariance[:] = 0.5 * (self.covariance + self.covariance.T)
        moved = gain @ innovation
        self._past += moved
        for term in self._terms:
            term += moved
            moved = self.tick * (self.chain @ moved)
        return True

    def correct_entry(self, stamp_ns: int, index: int, value: float, variance: float, gate: float = GATE) -> bool:
        """The same for one measured entry of the state: one compiled call."""
        if not self._go_to(stamp_ns):
            return False
        innovation, spread = value - self._past.item(index), self.covariance.item(index, index) + variance
        if innovation * innovation > gate * gate * spread:
            return False
        entries = self._entries
        entries[0, index] = 1.0
        self._take(1.0 / spread, 0.0, 0.0, innovation, 0.0)
        entries[0, index] = 0.0
        return True

    def correct_pair(
        self, stamp_ns: int, first: int, values: tuple[float, float], covariance: tuple[float, float, float]
    ) -> bool:
        """The same for two neighbouring entries at once, with the covariance's entries (1,1), (1,2), (2,2)."""
        if not self._go_to(stamp_ns):
            return False
        p, past = self.covariance, self._past
        da, db = values[0] - past.item(first), values[1] - past.item(first + 1)
        aa = p.item(first, first) + covariance[0]
        ab = p.item(first, first + 1) + covariance[1]
        bb = p.item(first + 1, first + 1) + covariance[2]
        determinant = aa * bb - ab * ab
        wa, wb = (bb * da - ab * db) / determinant, (aa * db - ab * da) / determinant
        if da * wa + db * wb > 2.0 * GATE * GATE:
            return False
        entries = self._entries
        entries[0, first] = entries[1, first + 1] = 1.0
        self._take(bb / determinant, -ab / determinant, aa / determinant, da, db)
        entries[0, first] = entries[1, first + 1] = 0.0
        return True

    def _go_to(self, stamp_ns: int) -> bool:
        """Bring covariance and past state to a stamp; False if it is forgotten."""
        if stamp_ns == self._open:
            return True
        self._settle()
        age = self.ticks.age(stamp_ns)
        if age is None:
            return False
        if self._covariance_stamp >= 0:
            dt = max(0.0, (stamp_ns - self._covariance_stamp) * 1e-9)
            if dt > 0.0:
                self._propagate(min(dt, 1.0))
        self._covariance_stamp = max(stamp_ns, self._covariance_stamp)
        self._open, self._age = stamp_ns, age
        self._past[:] = self._history[self.ticks.slot(age)]
        return True

    def _take(self, wa: float, wab: float, wb: float, da: float, db: float) -> None:
        """Correct by what `_entries` say is measured; see `ibvs_qp.estimation.correction`."""
        _put_six(self._measured.data, 0, wa, wab, wb, da, db, self.tick)
        self._correct()
        self._belief[:] = self._corrected

    def _propagate(self, dt: float) -> None:
        self._time[0] = dt
        self._propagated()
        self.covariance[:] = self._product

    def _settle(self) -> None:
        """Add what was corrected at a past tick, and what has become of it since, to the history."""
        if self._open < 0:
            return  # nothing was
        age, terms, self._open = self._age, self._terms, -1
        path = self._paths(age).dot(terms)
        terms[:] = 0.0
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
