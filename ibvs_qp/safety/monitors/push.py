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
MOST_WIND = 10.0
#: A sensor that measures this fraction of its reference, and this push at least, is not dead [-, N]: the wind along the
#: normal explains up to five standard deviations of the strongest gusts flown, 3 N [N]. Two false alarms had 12 N.
FOLLOWED, LEAST_FOLLOWED, MOST_NORMAL_WIND = 0.5, 1.0, 15.0
#: Its measured push is an average over this time [s]: a gust lifts the tip off the wall for less.
FOLLOWED_TIME_S = 0.3
#: A push may follow its reference down for this long [s]: the tip leaves the wall after a touch ramp's time.
RELEASE_S = 0.5


class PushMonitor:
    """Compares the force sensor with the reference and with the push by inertial data.

    The sensor may be dead, or measure zero, before the touch or in contact; controller and observers then press until
    the rotors saturate, 30 N for 5 N. Thrust against acceleration measures the push without it. A gust changes that
    figure too, so the sensor must disagree widely, and by more than the gusts along the wall explain. A dead sensor
    does not follow the reference; one that does may differ by a gust along the normal, which nothing else measures.
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
        self._mean, self._time = 0.0, 0.0

    def update(self, tick: Tick, response: Response, time_s: float) -> None:
        """Add the faults of the push."""
        settings, contact = self._settings, tick.contact
        push, reference, inertial = contact.push, self._recent(tick.push_reference, time_s), response.inertial_push
        bound = max(settings.push_ratio * reference, settings.push_floor_n)
        if self._high.update(push > bound, time_s):
            tick.faults[Fault.PUSH_HIGH] = f"{push:.1f} N, bound {bound:.1f} N"
        least = min(max(UNFELT_OVER_REFERENCE * reference, LEAST_UNFELT), settings.unfelt_push_n)
        unfelt = inertial > least and push < settings.unfelt_ratio * inertial and contact.distance < NEAR_WALL
        wind = min(WIND_SIGMAS * response.wind_spread, MOST_WIND)
        if self._average(push, time_s) > max(FOLLOWED * reference, LEAST_FOLLOWED):
            wind = MOST_NORMAL_WIND
        windy = inertial - push <= wind
        if self._unfelt.update(unfelt and not windy, time_s):
            tick.faults[Fault.PUSH_UNFELT] = f"{inertial:.1f} N, measured {push:.1f} N"

    def _average(self, push: float, time_s: float) -> float:
        """Measured push, low-passed [N]."""
        self._mean += (1.0 - math.exp((self._time - time_s) / FOLLOWED_TIME_S)) * (push - self._mean)
        self._time = time_s
        return self._mean

    def _recent(self, reference: float, time_s: float) -> float:
        """Largest reference while the push may still follow it [N]."""
        if reference >= self._reference or time_s - self._since > RELEASE_S:
            self._reference, self._since = reference, time_s
        return self._reference
