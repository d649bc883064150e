"""Push against the wall: a measured one that is too high, and one that the force sensor does not measure."""

from __future__ import annotations

import math

from ibvs_qp.config import SafetySettings
from ibvs_qp.safety.monitors.persistence import Persistence
from ibvs_qp.safety.policy import Fault
from ibvs_qp.safety.tick import Response, Tick

#: The tip can touch the wall nearer than this by the estimate, whose error a wrong mount or plane makes [m].
NEAR_WALL = 0.06
#: Push by inertial data, over the reference, that the sensor must measure, and its least value [-, N].
UNFELT_OVER_REFERENCE, LEAST_UNFELT = 1.6, 4.0

#: The push by inertial data exceeds the measured one by so many standard deviations of the wind [-]: 4.5 left alarms in
#: 2 of 16 flights in gusts of 2 and 3 N rms.
WIND_SIGMAS = 6.0
#: The wind excuses no larger difference [N]: with a dead sensor friction counts as wind, and the push reached 22 N.
#: Wind of free flight has no friction in it, and excuses as much as `NORMAL_WIND`.
MOST_WIND = 10.0
#: A sensor that measures this fraction of its reference, and this push at least, is not dead [-, N].
FOLLOWED, LEAST_FOLLOWED = 0.5, 1.0
#: Then the difference is the wind along the normal, which explains so many deviations of that along the wall, and this
#: force at least [N]. False alarms had 12 N in gusts of 3 N rms and 17 N in gusts of 4 N rms.
NORMAL_WIND = 15.0
#: It is remembered for this long [s], because a gust takes the tip off the wall.
WIND_MEMORY_S = 5.0
#: Its measured push is an average over this time [s]: a gust lifts the tip off the wall for less.
FOLLOWED_TIME_S = 0.3
#: A push may follow its reference down for this long [s]: the tip leaves the wall after a touch ramp's time.
RELEASE_S = 0.5


class PushMonitor:
    """Compares the force sensor with the reference and with the push by inertial data.

    The sensor may be dead, or measure zero, before the touch or in contact; controller and observers then press until
    the rotors saturate, 30 N for 5 N. Thrust against acceleration measures the push without it. A gust changes that
    figure too, so the sensor must disagree widely, and by more than the gusts along the wall and those of the approach
    explain. A dead sensor does not follow the reference; one that does may differ by a gust along the normal, which
    nothing else measures. That gust goes on when it takes the tip off the wall.
    """

    def __init__(self, settings: SafetySettings) -> None:
        self._settings = settings
        self._high, self._unfelt = Persistence(settings.push_time_s), Persistence(settings.push_time_s)
        self.reset()

    def reset(self) -> None:
        """As before the flight."""
        self._high.reset()
        self._unfelt.reset()
        self._reference, self._since = 0.0, 0.0
        self._mean, self._wind, self._free_wind, self._time = 0.0, 0.0, 0.0, 0.0

    def update(self, tick: Tick, response: Response, time_s: float) -> None:
        """Add the faults of the push."""
        settings, contact = self._settings, tick.contact
        push, reference, inertial = contact.push, self._recent(tick.push_reference, time_s), response.inertial_push
        bound = max(settings.push_ratio * reference, settings.push_floor_n)
        if self._high.update(push > bound, time_s):
            tick.faults[Fault.PUSH_HIGH] = f"{push:.1f} N, bound {bound:.1f} N"
        least = min(max(UNFELT_OVER_REFERENCE * reference, LEAST_UNFELT), settings.unfelt_push_n)
        unfelt = inertial > least and push < settings.unfelt_ratio * inertial and contact.distance < NEAR_WALL
        spread = WIND_SIGMAS * response.wind_spread
        if contact.distance > NEAR_WALL:
            self._free_wind = min(spread, NORMAL_WIND)
        followed, normal_wind = self._normal_wind(inertial - push, push, reference, time_s)
        wind = max(spread, NORMAL_WIND) if followed else max(min(spread, MOST_WIND), self._free_wind, normal_wind)
        windy = inertial - push <= wind
        if self._unfelt.update(unfelt and not windy, time_s):
            tick.faults[Fault.PUSH_UNFELT] = f"{inertial:.1f} N, measured {push:.1f} N"

    def _normal_wind(self, difference: float, push: float, reference: float, time_s: float) -> tuple[bool, float]:
        """Whether the sensor follows the reference, and the difference while it did, low-passed [N]."""
        passed, self._time = time_s - self._time, time_s
        self._mean += (1.0 - math.exp(-passed / FOLLOWED_TIME_S)) * (push - self._mean)
        followed = self._mean > max(FOLLOWED * reference, LEAST_FOLLOWED)
        target, within = (difference, FOLLOWED_TIME_S) if followed else (0.0, WIND_MEMORY_S)
        self._wind += (1.0 - math.exp(-passed / within)) * (target - self._wind)
        self._wind = min(max(self._wind, 0.0), NORMAL_WIND)
        return followed, self._wind

    def _recent(self, reference: float, time_s: float) -> float:
        """Largest reference while the push may still follow it [N]."""
        if reference >= self._reference or time_s - self._since > RELEASE_S:
            self._reference, self._since = reference, time_s
        return self._reference
