"""Start-up self-check: sensor data in other axes than front-right-down and north-east-down, found before contact.

Level and at rest many wrong conventions look right. So the check goes on until the first touch: accelerometer and load
of the force sensor at rest, attitude against accelerometer and gyro, and the force of the first touch against the
wall's normal.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ibvs_qp.frames import down_in_body
from ibvs_qp.validation.load_check import LoadCheck
from ibvs_qp.validation.rest_check import RestCheck
from ibvs_qp.validation.touch_check import TouchCheck
from ibvs_qp.validation.turn_check import TurnCheck


class SelfCheck:
    """Checks the axes of attitude, inertial sensors and force sensor; `faults` has its findings.

    Attributes:
        done: Whether nothing is left to check: after a first touch with the right axes, or disabled.

    Args:
        enabled: Whether anything is checked.
        load: Check of the force sensor's load, for raw readings; None for a tared wrench.
    """

    def __init__(self, enabled: bool, load: LoadCheck | None = None) -> None:
        self._enabled, self._load = enabled, load
        self.reset()

    def reset(self) -> None:
        """As before the first tick."""
        self._rest, self._turn, self._touch = RestCheck(), TurnCheck(), TouchCheck()
        if self._load is not None:
            self._load.reset()
        self.done = not self._enabled

    @property
    def passed(self) -> bool:
        """Whether the vehicle may approach the wall: the sensors agreed at rest, and nothing was found since."""
        return self.done or (self._rest.passed and not self.faults())

    def faults(self) -> tuple[str, ...]:
        """Findings in words; empty without a fault, and after a first touch with the right axes."""
        if self.done:
            return ()
        load = () if self._load is None else self._load.faults
        return (*self._rest.faults, *self._turn.faults, *load, *self._touch.faults)

    @property
    def note(self) -> str:
        """Finding of the check of the force sensor's load that is no fault."""
        return "" if self._load is None else self._load.note

    def inertial(self, attitude: Sequence[float], rate: Sequence[float], force: Sequence[float], dt: float) -> None:
        """Add a tick: quaternion B in I, gyro [rad/s], accelerometer [m/s^2], time since the last tick [s]."""
        if self.done:
            return
        if not self._rest.passed:
            self._rest.add(down_in_body(attitude), rate, force, dt)
        self._turn.add(attitude, rate, dt)

    def load(self, wrench: np.ndarray, stamp_ns: int, force: Sequence[float], free: bool, dt: float) -> None:
        """Add the raw force sensor of one tick; arguments as of `ibvs_qp.validation.load_check.LoadCheck.add`."""
        if not self.done and self._load is not None:
            self._load.add(wrench, stamp_ns, force, free, dt)

    def contact(self, raw: Sequence[float], noise: float, normal: Sequence[float], distance: float, dt: float) -> None:
        """Add the force sensor of one tick.

        Args:
            raw: Its force, vehicle on tool [N], (3,).
            noise: Standard deviation of the filtered push in free flight [N].
            normal: Unit vector into the wall, in B, (3,).
            distance: Tip to wall [m], infinite while unknown.
            dt: Time since the last tick [s].
        """
        if not self.done:
            self._touch.add(raw, noise, normal, distance, dt)
            self.done = self._touch.passed and self.passed
