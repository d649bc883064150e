"""Standstill of the tip: before a touch, and at the end of a stroke."""

from __future__ import annotations

import math

from ibvs_qp.pilot.painting.command import PainterInput
from ibvs_qp.pilot.painting.config import PaintingConfig

#: Remaining distance at which the commanded speed becomes zero [m]; speed at a stop over `align_speed_m_s` [-].
STOP_DISTANCE, STOP_SPEED_RATIO = 0.002, 2.0


class StrokeEnd:
    """A stroke ends near its goal and still, or once it was waited for too long."""

    def __init__(self, config: PaintingConfig) -> None:
        self._config, self._stopped = config, math.inf

    def is_reached(self, inputs: PainterInput, remaining: float) -> bool:
        """Whether the stroke ends with that distance left [m]."""
        config = self._config
        if remaining > STOP_DISTANCE:
            return False
        self._stopped = min(self._stopped, inputs.time_s)
        waited = inputs.time_s - self._stopped
        still = math.hypot(*inputs.velocity[:2]) < STOP_SPEED_RATIO * config.align_speed_m_s
        near = abs(remaining) < config.stop_error_m
        return (waited > config.stop_time_s and still and near) or waited > config.stop_timeout_s


class Alignment:
    """The tip is aligned once error and speed, averaged over the sway of hover, stay within their tolerances.

    Gusts and noisy pictures may prevent any standstill, so the tolerances open with time.

    Attributes:
        error, speed: Averaged, the larger error [m] and the speed [m/s]; infinite without a guide.
    """

    def __init__(self, config: PaintingConfig) -> None:
        self._config, self._since = config, math.inf
        self._average: list[float] = []
        self.error = self.speed = math.inf

    def is_reached(self, inputs: PainterInput, errors: tuple[float, float], began: float, dt: float) -> bool:
        """Whether the tip is aligned, by errors of its place across and along the strokes [m]; begun at a time [s]."""
        now = [*errors, *inputs.velocity[:2]]
        if all(map(math.isfinite, now)):
            ratio, last = 1.0 - math.exp(-dt / self._config.align_average_s), self._average or now
            self._average = [old + ratio * (new - old) for old, new in zip(last, now, strict=True)]
            high, aside, right, down = self._average
            self.error, self.speed = max(abs(high), abs(aside)), math.hypot(right, down)
        else:
            self._average, self.error, self.speed = [], math.inf, math.inf
        most_error, most_speed = self._limits(inputs.time_s - began)
        aligned = self.error < most_error and self.speed < most_speed
        self._since = min(self._since, inputs.time_s) if aligned else math.inf
        return inputs.time_s - self._since >= self._config.align_time_s

    def state(self, waited: float) -> str:
        """Error and speed with their limits, in words, after that time [s]."""
        if math.isinf(self.error):
            return "no guide in view"
        (error, speed), limits = (self.error * 1e3, self.speed * 1e3), [1e3 * limit for limit in self._limits(waited)]
        return f"line error {error:.1f} mm, limit {limits[0]:g} mm; speed {speed:.0f} mm/s, limit {limits[1]:g} mm/s"

    def _limits(self, waited: float) -> tuple[float, float]:
        """Of error [m] and speed [m/s] after that time [s]."""
        config = self._config
        opening = min(max(1.0, (waited / config.align_patience_s) ** 2), config.align_opening_max)
        return opening * config.align_error_m, opening * config.align_speed_m_s
