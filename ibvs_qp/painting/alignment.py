"""Alignment before a touch: still and on its lines, averaged over the sway of hover."""

from __future__ import annotations

import math

from ibvs_qp.painting.command import PainterInput
from ibvs_qp.painting.config import PaintingConfig


class Alignment:
    """Decides when the tip is aligned.

    A vehicle in hover sways within the tolerances, so error and speed are averaged. Gusts and
    noisy pictures may prevent any standstill, so the tolerances open with time.

    Attributes:
        error, speed: Averaged line error [m] and speed [m/s].
    """

    def __init__(self, config: PaintingConfig) -> None:
        self._config = config
        self._average: tuple[float, ...] | None = None
        self._since = math.nan
        self.error = self.speed = math.inf

    def is_reached(self, inputs: PainterInput, errors: tuple[float, float], began: float, dt: float) -> bool:
        """Whether the errors of guide and start mark [m] and the speed have stayed within their tolerances long enough.

        ``began`` is the begin of the alignment and ``dt`` the time since the last tick [s].
        """
        config, opening = self._config, self._opening(inputs.time_s - began)
        self.error, self.speed = self._averaged((*errors, *inputs.velocity[:2]), dt)
        if not (self.error < opening * config.align_error_m and self.speed < opening * config.align_speed_m_s):
            self._since = math.nan
            return False
        if math.isnan(self._since):
            self._since = inputs.time_s
        return inputs.time_s - self._since >= config.align_time_s

    def state(self, waited: float) -> str:
        """Error and speed with their limits, in words, after that time [s]."""
        if math.isinf(self.error):
            return "no guide in view"
        opening, config = self._opening(waited), self._config
        limits = opening * config.align_error_m * 1e3, opening * config.align_speed_m_s * 1e3
        error, speed = self.error * 1e3, self.speed * 1e3
        return f"line error {error:.1f} mm, limit {limits[0]:g} mm; speed {speed:.0f} mm/s, limit {limits[1]:g} mm/s"

    def _opening(self, waited: float) -> float:
        """Factor on both tolerances after that time [s]."""
        config = self._config
        return min(max(1.0, (waited / config.align_patience_s) ** 2), config.align_opening_max)

    def _averaged(self, now: tuple[float, ...], dt: float) -> tuple[float, float]:
        """Largest averaged error [m] and averaged speed [m/s]; infinite without a guide."""
        if not all(map(math.isfinite, now)):
            self._average = None
            return math.inf, math.inf
        ratio = 1.0 - math.exp(-dt / self._config.align_average_s)
        last = self._average or now
        self._average = tuple(old + ratio * (new - old) for old, new in zip(last, now, strict=True))
        high, aside, right, down = self._average
        return max(abs(high), abs(aside)), math.hypot(right, down)
