"""Force of the first touch against the wall's normal."""

from __future__ import annotations

import math
from collections.abc import Sequence

from ibvs_qp.frames import Vector3, add_scaled, dot

#: Beyond this distance the sensor's mean is the load without contact [m]; averaging time at least and at most [s].
FREE_DISTANCE, LEAST_TIME, LONGEST_TIME = 0.04, 0.5, 5.0
#: A touch is evaluated within this distance of the wall [m], beyond this force [N] and this many standard deviations in
#: free flight; the force is filtered over this time [s].
TOUCH_DISTANCE, TOUCH_FORCE, TOUCH_SIGMAS, FILTER_TIME = 0.02, 2.0, 6.0, 0.1
#: Cosine of the angle between the force and the normal out of the wall: at least with a friction of 0.8 and right
#: axes; at most with wrong ones.
LEAST_RIGHT, LARGEST_WRONG = 0.7, 0.5


class TouchCheck:
    """Finds a force sensor whose axes are swapped or of the wrong sign.

    It reads the raw sensor: the tare trusts the moments, which are wrong as well then.

    Attributes:
        passed: Whether a touch was felt in the right direction.
        faults: In words.
    """

    def __init__(self) -> None:
        self.passed = False
        self.faults: tuple[str, ...] = ()
        self._load: Vector3 = (0.0, 0.0, 0.0)
        self._force: Vector3 = (0.0, 0.0, 0.0)
        self._time = 0.0

    def add(self, raw: Sequence[float], noise: float, normal: Sequence[float], distance: float, dt: float) -> None:
        """Add a tick; arguments as of `ibvs_qp.validation.self_check.SelfCheck.contact`."""
        if distance > FREE_DISTANCE:
            self._time = min(self._time + dt, LONGEST_TIME)
            gain = dt / max(self._time, dt)
            self._load = add_scaled(self._load, gain, add_scaled(raw, -1.0, self._load))
            self._force = (0.0, 0.0, 0.0)
            return
        touch, gain = add_scaled(self._load, -1.0, raw), 1.0 - math.exp(-dt / FILTER_TIME)
        self._force = add_scaled(self._force, gain, add_scaled(touch, -1.0, self._force))
        size = math.hypot(*self._force)
        if self._time < LEAST_TIME or distance > TOUCH_DISTANCE or size < max(TOUCH_FORCE, TOUCH_SIGMAS * noise):
            return
        cosine = -dot(self._force, normal) / size
        self.passed = cosine >= LEAST_RIGHT
        if cosine <= LARGEST_WRONG:
            x, y, z = self._force
            self.faults = (
                f"wrench: the first touch is ({x:.1f}, {y:.1f}, {z:.1f}) N on the vehicle, not against the approach; "
                "axes of the force sensor swapped or of the wrong sign",
            )
