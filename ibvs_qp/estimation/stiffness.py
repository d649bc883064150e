"""Stiffness of brush and wall, estimated while pressing."""

from __future__ import annotations

import math

from ibvs_qp.config import ContactSettings

#: Samples needed before a slope is computed.
LEAST_SAMPLES = 30


class StiffnessEstimator:
    """Slope of push against penetration over a press, by least squares with the running means removed.

    Attributes:
        value: Stiffness [N/m]; the assumed one until it is known.
        known: Whether it was measured.

    Args:
        settings: Force filter and `estimation` settings.
    """

    def __init__(self, settings: ContactSettings) -> None:
        self._settings = settings
        self.reset()

    def reset(self) -> None:
        """Forget the estimate."""
        self.value, self.known = self._settings.estimation.assumed_stiffness_n_m, False
        self.start()

    def start(self) -> None:
        """Start anew at a touch; the last estimate remains until a better one exists."""
        self._time, self._count, self._depth = 0.0, 0, math.nan
        self._x = self._y = self._xy = self._yy = 0.0  # sums of penetration, push and their products

    def add(self, push: float, penetration: float, dt: float) -> None:
        """Add one filtered push [N] and the penetration [m], ``dt`` [s] after the last."""
        settings = self._settings.estimation
        self._time += dt
        if self._time > settings.stiffness_time_s:
            return
        # The same filter as the push, so that both lag alike.
        gain = 1.0 - math.exp(-2.0 * math.pi * self._settings.force_filter_hz * dt)
        self._depth = x = penetration if math.isnan(self._depth) else self._depth + gain * (penetration - self._depth)
        self._count += 1
        self._x, self._y = self._x + x, self._y + push
        self._xy, self._yy = self._xy + x * push, self._yy + push * push
        mean_x, mean_y = self._x / self._count, self._y / self._count
        variance = self._yy / self._count - mean_y * mean_y
        covariance = self._xy / self._count - mean_x * mean_y
        # Regress penetration on push: the push is the cleaner signal, so the slope is not biased low.
        pressed = variance > settings.stiffness_push_spread_n**2 and self._count > LEAST_SAMPLES
        if pressed and covariance > 0.0:
            slope = variance / covariance
            self.value = min(max(slope, settings.stiffness_min_n_m), settings.stiffness_max_n_m)
            self.known = True
