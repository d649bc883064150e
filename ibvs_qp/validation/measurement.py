"""What may enter a controller: every field is checked, what fails is named and replaced by the last good value."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from math import hypot
from operator import le
from typing import Any

import numpy as np

from ibvs_qp.measurement import Measurement
from ibvs_qp.validation.fields import (
    ACCELERATION_BOUND,
    PLANE_BOUND,
    RATE_BOUND,
    THRUST_BOUND,
    UNIT_SLIP,
    VELOCITY_BOUND,
    WRENCH_BOUND,
    entries,
    good_line,
    is_number,
    sound_vector,
    surely_good_lines,
)

#: A stamp this far from the last one is a fault until the next ones agree with it [ns].
LEAP_NS = 1_000_000_000
#: Stamps in a row that must agree until a clock that went back is believed.
RESTART_STAMPS = 25
#: Stamps end here: a whole number of nanoseconds in 63 bits with room for a sum.
STAMP_END = 2**62
#: A sensor's stamp may lead the tick's by this much [ns].
LEAD_NS = 20_000_000
_THREE, _FOUR, _SIX = (3,), (4,), (6,)


def is_stamp(value: Any) -> bool:
    """Whether a value is a time stamp: a whole number of nanoseconds that fits 63 bits."""
    if type(value) is int:
        return 0 <= value < STAMP_END
    return isinstance(value, (int, np.integer)) and not isinstance(value, bool) and bool(0 <= value < STAMP_END)


def answered_stamp(measurement: Any) -> int:
    """Stamp of whatever was handed in, 0 if it has none."""
    stamp = measurement.stamp_ns if isinstance(measurement, Measurement) else None
    return int(stamp) if stamp is not None and is_stamp(stamp) else 0


class MeasurementGate:
    """Passes good measurements on untouched, mends bad ones, and says what it refused.

    Attributes:
        restarted: Whether the last measurement began a new time base, behind the old one.
    """

    def __init__(self, rotors: int) -> None:
        self._rotors, self._shape = rotors, (rotors,)
        self.reset()

    def reset(self) -> None:
        """Forget the last good values."""
        self._attitude: Sequence[float] | None = None
        self._rate: Sequence[float] = [0.0] * 3
        self._wrench: Sequence[float] = [0.0] * 6
        self._plane: tuple[float, ...] | None = None
        self._wrench_stamp = 0
        self._stamp: int | None = None
        self._odd_stamp, self._odd_count = -1, 0
        self.restarted = False

    @property
    def inertial(self) -> Measurement | None:
        """Last good attitude and rate, for the last resort; None when nothing was ever measured."""
        if self._attitude is None:
            return None
        return Measurement(
            stamp_ns=self._stamp or 0,
            attitude=np.array(self._attitude),
            angular_velocity=np.array(self._rate),
            contact_wrench=np.array(self._wrench),
            wrench_stamp_ns=self._wrench_stamp,
        )

    def check(self, measurement: Measurement) -> tuple[Measurement | None, tuple[str, ...]]:
        """A measurement that is safe to use, or None when not even an attitude is known, and what was refused."""
        self.restarted = False
        if type(measurement) is Measurement and self._sound(measurement):
            return measurement, ()
        return self._mend(measurement)

    def _sound(self, measurement: Measurement) -> bool:
        """Whether surely nothing is to refuse; where it is not sure, `_mend` finds out field by field."""
        stamp, wrench_stamp, plane = measurement.stamp_ns, measurement.wrench_stamp_ns, measurement.plane
        if type(stamp) is not int or type(wrench_stamp) is not int or not 0 <= wrench_stamp <= stamp + LEAD_NS:
            return False
        if self._stamp is None or self._odd_count or not 0 < stamp - self._stamp <= LEAP_NS or stamp >= STAMP_END:
            return False
        if plane is not None and not (plane is self._plane or self._known_plane(plane)):
            return False
        if plane is not None and not _past(measurement.plane_stamp_ns, stamp):
            return False
        if not surely_good_lines(measurement.lines):
            return False
        if not self._good_limits(measurement):
            return False
        attitude, rate = entries(measurement.attitude, _FOUR), entries(measurement.angular_velocity, _THREE)
        wrench = entries(measurement.contact_wrench, _SIX)
        force, velocity = measurement.specific_force, measurement.velocity
        length = hypot(*attitude)
        if not (
            abs(length * length - 1.0) <= UNIT_SLIP
            and hypot(*rate) <= RATE_BOUND
            and hypot(*wrench) <= WRENCH_BOUND
            and (force is None or hypot(*entries(force, _THREE)) <= ACCELERATION_BOUND)
            and (velocity is None or hypot(*entries(velocity, _THREE)) <= VELOCITY_BOUND)
        ):
            return False
        self._attitude, self._rate, self._wrench = attitude, rate, wrench
        self._stamp, self._wrench_stamp = stamp, wrench_stamp
        return True

    def _good_limits(self, measurement: Measurement) -> bool:
        """Whether the thrust limits are surely sound, if there are any."""
        low, high = measurement.thrust_min, measurement.thrust_max
        if low is None and high is None:
            return True
        lowest = None if low is None else entries(low, self._shape)
        highest = None if high is None else entries(high, self._shape)
        if not (lowest is None or hypot(*lowest) <= THRUST_BOUND):
            return False
        if not (highest is None or hypot(*highest) <= THRUST_BOUND):
            return False
        return lowest is None or highest is None or all(map(le, lowest, highest))

    def _mend(self, measurement: Measurement) -> tuple[Measurement | None, tuple[str, ...]]:
        """Field by field: what fails is named and replaced by the last good value."""
        changes: dict[str, Any] = {}
        rejected: list[str] = []

        def refuse(name: str, why: str, value: Any) -> None:
            rejected.append(f"{name}: {why}")
            changes[name] = value

        if not isinstance(measurement, Measurement):
            return None, ("measurement: not a Measurement",)
        why = self._refuse_stamp(measurement.stamp_ns)
        if why:
            return None, (f"stamp_ns: {why}",)
        stamp, attitude = int(measurement.stamp_ns), measurement.attitude
        if not sound_vector(attitude, 4, 1.01) or abs(float(attitude @ attitude) - 1.0) > UNIT_SLIP:
            if self._attitude is None:
                return None, ("attitude: not a unit quaternion",)
            refuse("attitude", "not a unit quaternion", np.array(self._attitude))
        else:
            self._attitude = attitude.tolist()
        if sound_vector(measurement.angular_velocity, 3, RATE_BOUND):
            self._rate = measurement.angular_velocity.tolist()
        else:
            refuse("angular_velocity", f"not 3 finite values within {RATE_BOUND} rad/s", np.array(self._rate))
        if measurement.specific_force is not None and not sound_vector(
            measurement.specific_force, 3, ACCELERATION_BOUND
        ):
            refuse("specific_force", f"not 3 finite values within {ACCELERATION_BOUND} m/s^2", None)
        changes |= self._check_wrench(measurement, stamp, refuse)
        if measurement.plane is not None and not self._known_plane(measurement.plane):
            refuse("plane", "not 4 finite values with D != 0 in front of the camera", None)
        elif measurement.plane is not None and not _past(measurement.plane_stamp_ns, stamp):
            rejected.append("plane_stamp_ns: not a time before the tick")
            changes |= {"plane": None, "plane_stamp_ns": 0}
        if measurement.velocity is not None and not sound_vector(measurement.velocity, 3, VELOCITY_BOUND):
            refuse("velocity", f"not 3 finite values within {VELOCITY_BOUND} m/s", None)
        self._check_lines(measurement, refuse)
        self._check_limits(measurement, refuse)
        self._stamp = stamp
        return (dataclasses.replace(measurement, **changes) if changes else measurement), tuple(rejected)

    def _refuse_stamp(self, stamp: Any) -> str:
        """Why a stamp is refused, empty if it is not: one leap must blind nobody, a clock set anew is followed."""
        if not is_stamp(stamp):
            return "not a whole number of nanoseconds"
        if self._stamp is None or 0 < stamp - self._stamp <= LEAP_NS:
            self._odd_count = 0
            return ""
        follows = self._odd_count > 0 and 0 < stamp - self._odd_stamp <= LEAP_NS
        self._odd_stamp, self._odd_count = int(stamp), self._odd_count + 1 if follows else 1
        ahead = stamp > self._stamp
        if follows and (ahead or self._odd_count >= RESTART_STAMPS):
            self._odd_count, self.restarted = 0, not ahead
            return ""
        return "far ahead of the last one" if ahead else "not after the last one"

    def _check_wrench(self, measurement: Measurement, stamp: int, refuse: Any) -> dict[str, Any]:
        """Both go back together: an old wrench under a new stamp would pass for news."""
        good, past = (
            sound_vector(measurement.contact_wrench, 6, WRENCH_BOUND),
            _past(measurement.wrench_stamp_ns, stamp),
        )
        if good and past:
            self._wrench, self._wrench_stamp = measurement.contact_wrench.tolist(), int(measurement.wrench_stamp_ns)
            return {}
        kept = np.array(self._wrench)
        if not good:
            refuse("contact_wrench", f"not 6 finite values within {WRENCH_BOUND} N or N m", kept)
        if not past:
            refuse("wrench_stamp_ns", "not a time before the tick", self._wrench_stamp)
        return {"contact_wrench": kept, "wrench_stamp_ns": self._wrench_stamp}

    def _known_plane(self, plane: Any) -> bool:
        """Whether a plane is sound; the tuple of the last tick, which cannot have changed, is not asked again."""
        if plane is self._plane:
            return True
        good = _good_plane(plane)
        self._plane = plane if good and type(plane) is tuple else None
        return good

    def _check_lines(self, measurement: Measurement, refuse: Any) -> None:
        if not isinstance(measurement.lines, tuple):
            refuse("lines", "not a tuple", ())
            return
        good = tuple(line for line in measurement.lines if good_line(line))
        if len(good) != len(measurement.lines):
            refuse("lines", f"{len(measurement.lines) - len(good)} not finite or malformed", good)

    def _check_limits(self, measurement: Measurement, refuse: Any) -> None:
        if measurement.thrust_min is None and measurement.thrust_max is None:
            return
        bounds = {}
        for name in ("thrust_min", "thrust_max"):
            value = getattr(measurement, name)
            good = value is not None and sound_vector(value, self._rotors, THRUST_BOUND)
            bounds[name] = value if good else None
            if value is not None and not good:
                refuse(name, f"not {self._rotors} finite values", None)
        low, high = bounds["thrust_min"], bounds["thrust_max"]
        if low is not None and high is not None and (low > high).any():
            refuse("thrust_max", "below thrust_min; raised to it", np.maximum(low, high))


def _past(stamp: Any, tick: int) -> bool:
    return is_stamp(stamp) and stamp <= tick + LEAD_NS


def _good_plane(plane: Any) -> bool:
    if not isinstance(plane, (tuple, list, np.ndarray)) or len(plane) != 4:
        return False
    a, b, c, d = plane
    if not all(is_number(entry, -1e12, 1e12) for entry in plane) or d == 0.0:
        return False
    return abs(a / d) < PLANE_BOUND and abs(b / d) < PLANE_BOUND and 0.05 < -c / d < PLANE_BOUND
