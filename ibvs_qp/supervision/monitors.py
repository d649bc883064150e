"""Monitors: each compares one quantity of a tick with its bounds and adds its findings to the faults of the tick."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from ibvs_qp.command import Outcome
from ibvs_qp.config import SafetySettings
from ibvs_qp.estimation.contact_state import ContactState
from ibvs_qp.model.setpoints import Setpoints
from ibvs_qp.supervision.faults import Fault

#: Samples in a row, each different from the one before, that show a sensor with noise: half a second of force, and of
#: pictures. A simulator without noise may repeat values; its sensors are not monitored.
LIVELY_SAMPLES, LIVELY_PICTURES = 50, 15

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


@dataclass(slots=True, kw_only=True)
class Tick:
    """Inputs of the monitors at one tick; stamps in the caller's monotonic time, -1 for never.

    Attributes:
        stamp_ns: Time of the tick.
        imu_ns: Stamp of the oldest of attitude, gyro and accelerometer, each the last accepted one.
        wrench_ns, plane_ns, image_ns, lines_ns: Stamps of the last accepted samples, and of the last with a line.
        inertial: Attitude, gyro and accelerometer as measured; anything that differs from sample to sample.
        wrench: Force sample as measured, likewise.
        down: Unit gravity in B, (3,).
        rate: Angular velocity [rad/s], (3,).
        speed: Estimated speed [m/s], NaN if unknown.
        height: Change of height since the start [m], NaN if unknown.
        contact: Wall and contact.
        press: Whether the reference presses.
        push_reference: Push reference within reach [N].
        outcome: Of the controller's step.
        faults: Faults that the caller found; the monitors add theirs.
        has_camera: Whether there must be pictures and a plane some time after the first tick.
        plane_doubt: Why the last picture has no sound plane; empty after one, or where unknown.
    """

    stamp_ns: int
    imu_ns: int
    wrench_ns: int
    plane_ns: int
    image_ns: int
    lines_ns: int = -1
    inertial: object
    wrench: object
    down: Sequence[float]
    rate: Sequence[float]
    speed: float
    height: float
    contact: ContactState
    press: bool
    push_reference: float
    outcome: Outcome
    faults: dict[Fault, str] = field(default_factory=dict)
    has_camera: bool = False
    plane_doubt: str = ""


class Persistence:
    """True once a condition has held for a time [s] without a break."""

    def __init__(self, time_s: float) -> None:
        self._time_s = time_s
        self.reset()

    def reset(self) -> None:
        """As before the first tick."""
        self._since = math.nan

    def update(self, present: bool, time_s: float) -> bool:
        """Whether the condition, ``present`` or not at a time [s], has lasted."""
        if not present:
            self._since = math.nan
            return False
        if math.isnan(self._since):
            self._since = time_s
        return time_s - self._since >= self._time_s


class FrozenInput:
    """Detects a sensor that repeats a value although it has noise.

    Attributes:
        equal: Samples in a row that repeat the one before.

    Args:
        samples: Repetitions in a row that count as frozen.
        lively: Different samples in a row that show noise.
    """

    def __init__(self, samples: int, lively: int) -> None:
        self._limit, self._least = samples, lively
        self.reset()

    def reset(self) -> None:
        """As before the first sample."""
        self._last: Any = None
        self._lively = False
        self._different = self.equal = 0

    def add(self, sample: Any) -> None:
        """Count a new sample, of any type with a comparison."""
        if sample == self._last:
            self.equal, self._different = self.equal + 1, 0
            return
        self.equal, self._last = 0, sample
        self._different += 1
        self._lively = self._lively or self._different >= self._least

    @property
    def repeats(self) -> bool:
        """Whether the last sample repeats the one before."""
        return self._lively and self.equal > 0

    @property
    def frozen(self) -> bool:
        """Whether it repeats."""
        return self._lively and self.equal >= self._limit


class SampleMonitor:
    """Finds inputs that stopped, by their stamps, and inputs that repeat although their stamps go on."""

    def __init__(self, settings: SafetySettings) -> None:
        imu, wrench, first = settings.imu_age_s, settings.wrench_age_s, settings.first_picture_s
        # Oldest sample, and latest first one after the first tick [ns]; of a camera only where there is one.
        self._limits = tuple(
            (fault, round(1e9 * oldest), math.inf if latest is None else round(1e9 * latest), camera)
            for fault, oldest, latest, camera in (
                (Fault.IMU_STALE, imu, imu, False),
                (Fault.WRENCH_STALE, wrench, wrench, False),
                (Fault.PLANE_STALE, settings.plane_age_s, first, True),
                (Fault.IMAGE_STALE, settings.image_age_s, first, True),
                (Fault.LINES_STALE, settings.lines_age_s, None, True),
            )
        )
        self._imu = FrozenInput(settings.frozen_imu_samples, LIVELY_SAMPLES)
        self._wrench = FrozenInput(settings.frozen_samples, LIVELY_SAMPLES)
        self._picture = FrozenInput(settings.frozen_pictures, LIVELY_PICTURES)
        self._frozen = (
            (Fault.IMU_FROZEN, self._imu),
            (Fault.WRENCH_FROZEN, self._wrench),
            (Fault.IMAGE_FROZEN, self._picture),
        )
        self.reset()

    def reset(self) -> None:
        """As before the first tick."""
        for _, part in self._frozen:
            part.reset()
        self._first_ns = self._imu_ns = self._wrench_ns = -1

    def update(self, tick: Tick) -> None:
        """Add the faults of the inputs of a tick."""
        faults, now = tick.faults, tick.stamp_ns
        if self._first_ns < 0:
            self._first_ns = now
        stamps = tick.imu_ns, tick.wrench_ns, tick.plane_ns, tick.image_ns, tick.lines_ns
        for (fault, oldest, latest, camera), stamp in zip(self._limits, stamps, strict=True):
            if now - stamp <= oldest:  # nearly always
                continue
            if stamp >= 0:
                faults[fault] = f"{1e-6 * (now - stamp):.0f} ms old, limit {1e-6 * oldest:.0f} ms"
            elif now - self._first_ns > latest and (tick.has_camera or not camera):
                faults[fault] = "none yet"
        if tick.plane_doubt and Fault.PLANE_STALE in faults and Fault.IMAGE_STALE not in faults:
            faults[Fault.PLANE_STALE] += f"; {tick.plane_doubt}"
        if tick.imu_ns != self._imu_ns:
            self._imu_ns = tick.imu_ns
            self._imu.add(tick.inertial)
        if tick.wrench_ns != self._wrench_ns:
            self._wrench_ns = tick.wrench_ns
            self._wrench.add(tick.wrench)
        if self._imu.equal or self._wrench.equal or self._picture.equal:
            for fault, monitor in self._frozen:
                if monitor.frozen:
                    faults[fault] = f"{monitor.equal + 1} equal samples in a row"

    def add_picture(self, picture: object) -> bool:
        """Count a new picture, anything that differs from picture to picture; whether it differs from the last one."""
        self._picture.add(picture)
        return not self._picture.repeats


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
        self._references: list[tuple[float, float]] = []  # times [s] and values [N]
        self._mean, self._wind, self._free_wind, self._time = 0.0, 0.0, 0.0, 0.0

    def update(self, tick: Tick, response: Setpoints, time_s: float) -> None:
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
        recent = self._references  # falling values, the oldest first
        while recent and recent[-1][1] <= reference:
            recent.pop()
        recent.append((time_s, reference))
        while time_s - recent[0][0] > RELEASE_S:
            recent.pop(0)
        return recent[0][1]


class WallMonitor:
    """Finds a contact that ended although the reference presses: the wall moved away, or is not found again."""

    def __init__(self, settings: SafetySettings) -> None:
        self._settings = settings
        self._gone, self._lost = Persistence(settings.envelope_time_s), Persistence(settings.contact_lost_s)
        self.reset()

    def reset(self) -> None:
        """As before the first touch."""
        self._touched = False
        self._gone.reset()
        self._lost.reset()

    def update(self, tick: Tick, time_s: float) -> None:
        """Add a contact that ended although the reference presses."""
        contact, faults = tick.contact, tick.faults
        self._touched = tick.press and (self._touched or contact.in_contact)
        free = self._touched and not contact.in_contact
        if self._gone.update(free and contact.distance > self._settings.wall_gone_m, time_s):
            faults[Fault.WALL_GONE] = f"{1e3 * min(contact.distance, 10.0):.0f} mm from the tip"
        if self._lost.update(free, time_s):
            faults[Fault.CONTACT_LOST] = f"for {self._settings.contact_lost_s:g} s"


class EnvelopeMonitor:
    """Compares tilt, angular rate, speed, height and mission time with the flight envelope."""

    def __init__(self, settings: SafetySettings) -> None:
        self._settings = settings
        self._tilt_cosine = math.cos(math.radians(settings.tilt_deg))
        self._flip_cosine = math.cos(math.radians(settings.flip_deg))
        self._lasting = {
            fault: Persistence(settings.envelope_time_s)
            for fault in (Fault.TILT, Fault.FLIP, Fault.RATE, Fault.SPEED, Fault.HEIGHT)
        }
        self._outside = False

    def reset(self) -> None:
        """As before the flight."""
        self._outside = False
        for part in self._lasting.values():
            part.reset()

    def update(self, tick: Tick, time_s: float) -> None:
        """Add quantities outside the envelope; ``time_s`` is the time since the first tick [s]."""
        settings, cosine = self._settings, tick.down[2]
        turning, height = math.hypot(*tick.rate), abs(tick.height)
        inside = cosine >= self._tilt_cosine and turning <= settings.rate_rad_s
        if inside and not (tick.speed > settings.speed_m_s or height > settings.height_m):
            if self._outside:
                self.reset()
        else:
            self._outside = True
            angle = math.degrees(math.acos(min(max(cosine, -1.0), 1.0)))
            rate, speed = settings.rate_rad_s, settings.speed_m_s
            for fault, beyond, words in (
                (Fault.TILT, cosine < self._tilt_cosine, f"{angle:.0f} deg, bound {settings.tilt_deg:g} deg"),
                (Fault.FLIP, cosine < self._flip_cosine, f"{angle:.0f} deg, bound {settings.flip_deg:g} deg"),
                (Fault.RATE, turning > rate, f"{turning:.1f} rad/s, bound {rate:g} rad/s"),
                (Fault.SPEED, tick.speed > speed, f"{tick.speed:.1f} m/s, bound {speed:g} m/s"),
                (Fault.HEIGHT, height > settings.height_m, f"{tick.height:+.1f} m, bound {settings.height_m:g} m"),
            ):
                if self._lasting[fault].update(beyond, time_s):
                    tick.faults[fault] = words
        if time_s > settings.mission_s:
            tick.faults[Fault.MISSION_TIME] = f"{time_s:.0f} s, limit {settings.mission_s:g} s"
