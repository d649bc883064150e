"""Stop condition of a stroke."""

from __future__ import annotations

import math

from ibvs_qp.painting.command import PainterInput
from ibvs_qp.painting.config import PaintingConfig

#: Remaining distance at which the commanded speed becomes zero [m].
STOP_DISTANCE = 0.002
#: Speed at a stop relative to `PaintingConfig.align_speed_m_s`.
STOP_SPEED_RATIO = 2.0


class StrokeEnd:
    """A stroke ends near its goal and still, or once it was waited for too long."""

    def __init__(self, config: PaintingConfig) -> None:
        self._config = config
        self._stop_time = math.nan

    def begin(self) -> None:
        """A stroke begins."""
        self._stop_time = math.nan

    def is_near(self, remaining: float) -> bool:
        """Whether the stroke stops with that distance left [m]."""
        return remaining <= STOP_DISTANCE

    def is_reached(self, inputs: PainterInput, remaining: float) -> bool:
        """Whether the stroke ends with that distance left [m]."""
        config = self._config
        if not self.is_near(remaining):
            return False
        if math.isnan(self._stop_time):
            self._stop_time = inputs.time_s
        waited = inputs.time_s - self._stop_time
        still = math.hypot(*inputs.velocity[:2]) < STOP_SPEED_RATIO * config.align_speed_m_s
        near = abs(remaining) < config.stop_error_m
        return (waited > config.stop_time_s and still and near) or waited > config.stop_timeout_s
