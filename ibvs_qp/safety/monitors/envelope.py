"""Flight envelope: tilt, angular rate, speed, height and mission time."""

from __future__ import annotations

import math

from ibvs_qp.config import SafetySettings
from ibvs_qp.safety.monitors.persistence import Persistence
from ibvs_qp.safety.policy import Fault
from ibvs_qp.safety.tick import Tick


class EnvelopeMonitor:
    """Compares attitude, rates and path with the envelope; the time never leaps (`ibvs_qp.validation.clock`)."""

    def __init__(self, settings: SafetySettings) -> None:
        self._settings = settings
        self._tilt_cosine = math.cos(math.radians(settings.tilt_deg))
        self._flip_cosine = math.cos(math.radians(settings.flip_deg))
        self._tilt, self._flip, self._rate, self._speed, self._height = (
            Persistence(settings.envelope_time_s) for _ in range(5)
        )
        self._outside = False

    def reset(self) -> None:
        """As before the flight."""
        self._outside = False
        for part in (self._tilt, self._flip, self._rate, self._speed, self._height):
            part.reset()

    def update(self, tick: Tick, time_s: float) -> None:
        """Add what is outside the envelope; ``time_s`` is the time since the first tick [s]."""
        settings, cosine = self._settings, tick.down[2]
        turning, height = math.hypot(*tick.rate), abs(tick.height)
        inside = cosine >= self._tilt_cosine and turning <= settings.rate_rad_s
        if inside and not (tick.speed > settings.speed_m_s or height > settings.height_m):
            if self._outside:
                self.reset()
        else:
            self._outside = True
            self._judge(tick, turning, height, time_s)
        if time_s > settings.mission_s:
            tick.faults[Fault.MISSION_TIME] = f"{time_s:.0f} s, limit {settings.mission_s:g} s"

    def _judge(self, tick: Tick, turning: float, height: float, time_s: float) -> None:
        """Add those bounds that have been exceeded for long enough."""
        settings, faults, cosine = self._settings, tick.faults, tick.down[2]
        if self._tilt.update(cosine < self._tilt_cosine, time_s):
            faults[Fault.TILT] = f"{_angle(cosine):.0f} deg, bound {settings.tilt_deg:g} deg"
        if self._flip.update(cosine < self._flip_cosine, time_s):
            faults[Fault.FLIP] = f"{_angle(cosine):.0f} deg, bound {settings.flip_deg:g} deg"
        if self._rate.update(turning > settings.rate_rad_s, time_s):
            faults[Fault.RATE] = f"{turning:.1f} rad/s, bound {settings.rate_rad_s:g} rad/s"
        if self._speed.update(tick.speed > settings.speed_m_s, time_s):
            faults[Fault.SPEED] = f"{tick.speed:.1f} m/s, bound {settings.speed_m_s:g} m/s"
        if self._height.update(height > settings.height_m, time_s):
            faults[Fault.HEIGHT] = f"{tick.height:+.1f} m, bound {settings.height_m:g} m"


def _angle(cosine: float) -> float:
    return math.degrees(math.acos(min(max(cosine, -1.0), 1.0)))
