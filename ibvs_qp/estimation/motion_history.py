"""Motion of the body over the last third of a second, for samples that arrive late."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import casadi as ca

from ibvs_qp.estimation.stamps import AHEAD, BEFORE
from ibvs_qp.symbolic.logic import Number, both, where
from ibvs_qp.symbolic.signals import Signals

#: Least length of a full bin [s]: four ticks at 250 Hz, a tenth of a rotor's or the brush's time constants. All bins
#: but the newest are full: 0.304 s at least, whatever the ticks, which covers the oldest line that counts (0.3 s).
BIN_S, BINS = 0.016, 20
#: Rounding of the sum of a bin's ticks [s], far below a tick.
_ROUNDING_S = 1e-6
#: Smallest duration of a bin in a division [s].
_LEAST_S = 1e-9


class Step(NamedTuple):
    """Part of one bin that lies after a past time."""

    duration: ca.SX  # [s]
    angle: ca.SX  # rotation vector in B [rad], (3,)
    change: ca.SX  # change of the velocity in B [m/s], (3,)
    way: ca.SX  # way of the centre of mass in B [m], (3,); zero in a history without velocities


class MotionHistory:
    r"""Integrals of angular velocity, acceleration and velocity in bins of `BIN_S` or a tick more, the newest first.

    A late sample is carried to the present by the integrals since its capture; within a bin they grow linearly.

    Args:
        signals: Registry.
        elapsed: Time since the last tick [s].
        rate: Angular velocity in B [rad/s], (3,).
        acceleration: Acceleration without gravity in B [m/s^2], (3,).
        tick_s: Nominal control period [s].
        velocity: Velocity in B [m/s], (3,), or None where no way is needed.
    """

    def __init__(
        self,
        signals: Signals,
        elapsed: ca.SX,
        rate: ca.SX,
        acceleration: ca.SX,
        tick_s: float,
        velocity: ca.SX | None = None,
    ) -> None:
        self._tick_s = tick_s
        added = [elapsed, elapsed * rate, elapsed * acceleration]
        names = ["history.duration", "history.angle", "history.change"]
        if velocity is not None:
            added.append(elapsed * velocity)
            names.append("history.way")
        old = [
            ca.reshape(signals.state(name, part.numel() * BINS), -1, BINS)
            for name, part in zip(names, added, strict=True)
        ]
        full = old[0][0] > BIN_S - _ROUNDING_S
        self._bins = []
        for name, bins, part in zip(names, old, added, strict=True):
            shifted = ca.horzcat(part, bins[:, :-1])
            grown = ca.horzcat(bins[:, 0] + part, bins[:, 1:])
            self._bins.append(where(full, shifted, grown))
            signals.remember(name, ca.vec(self._bins[-1]))

    def covers(self, age: ca.SX) -> ca.SX:
        """Whether a sample of an age [s] lies within the time remembered."""
        length = ca.sum2(self._bins[0])
        return both(age >= -AHEAD * self._tick_s, age <= length + BEFORE * self._tick_s)

    def since(self, age: ca.SX) -> Iterator[Step]:
        """Parts of the bins after a time ``age`` [s] ago, the newest first."""
        duration, angle, change, *ways = self._bins
        begin: Number = 0.0
        for place in range(BINS):
            length = duration[place]
            share = ca.fmin(ca.fmax((age - begin) / ca.fmax(length, _LEAST_S), 0.0), 1.0)
            way = share * ways[0][:, place] if ways else ca.SX.zeros(3)
            yield Step(share * length, share * angle[:, place], share * change[:, place], way)
            begin = begin + length
