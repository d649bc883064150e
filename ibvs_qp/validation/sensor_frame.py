"""What may enter the pilot's estimators: an unsound raw sensor is named and replaced by its last good value."""

from __future__ import annotations

import dataclasses
from math import hypot
from typing import Any

import numpy as np

from ibvs_qp.measurement import SensorFrame
from ibvs_qp.validation.clock import StampFollower
from ibvs_qp.validation.fields import ACCELERATION_BOUND, RATE_BOUND, WRENCH_BOUND, entries
from ibvs_qp.validation.measurement import is_stamp

#: Name, size and largest believable entry of every raw vector.
_VECTORS = (
    ("attitude", 4, 1.01),
    ("angular_velocity", 3, RATE_BOUND),
    ("specific_force", 3, ACCELERATION_BOUND),
    ("wrench", 6, WRENCH_BOUND),
)
#: A quaternion whose squared length is this far from 1 is no attitude.
_UNIT_SLIP = 0.02
_THREE, _FOUR, _SIX = (3,), (4,), (6,)


class SensorGate:
    """Passes sound frames on; one NaN in a filter would stay there for the rest of the flight.

    The stamps of what it passes on never run backwards (`StampFollower`).

    Attributes:
        last: Last good numbers of every raw vector by name, the present ones where they are sound.
        clock: Turns the frames' stamps into the pilot's time.
    """

    def __init__(self) -> None:
        self.clock = StampFollower()
        self.reset()

    def reset(self) -> None:
        """Forget the last good values; level and still stands in for what was never seen."""
        self.last: dict[str, list[float]] = {
            "attitude": [1.0, 0.0, 0.0, 0.0],
            "angular_velocity": [0.0] * 3,
            "specific_force": [0.0, 0.0, -9.81],
            "wrench": [0.0] * 6,
        }
        self.clock.reset()
        self._wrench_stamp = 0

    def check(self, frame: Any) -> tuple[SensorFrame | None, tuple[str, ...]]:
        """A frame that is safe to filter, or None when it has no sound time, and the names of what was refused."""
        clock = self.clock
        if not (type(frame) is SensorFrame and clock.goes_on(frame.stamp_ns)):
            why = clock.refuse(frame.stamp_ns) if isinstance(frame, SensorFrame) else "not in a sensor frame"
            if why:
                return None, (f"sensor frame: stamp_ns {why}",)
        if clock.shift_ns:
            frame = _shifted(frame, clock.shift_ns)
        image, features = frame.image, frame.features
        if (image is None or _dated(image)) and (features is None or _dated(features)) and self._sound(frame):
            return frame, ()
        return self._mend(frame)

    def _sound(self, frame: SensorFrame) -> bool:
        """Whether surely nothing is to refuse; where it is not sure, `_mend` finds out name by name."""
        turn, turning = entries(frame.attitude, _FOUR), entries(frame.angular_velocity, _THREE)
        felt, load, stamp = entries(frame.specific_force, _THREE), entries(frame.wrench, _SIX), frame.wrench_stamp_ns
        if type(stamp) is not int or not 0 <= stamp <= frame.stamp_ns or len(turn) != 4:
            return False
        w, x, y, z = turn
        # A vector within the bound has no entry beyond it; NaN is within nothing.
        if not (
            abs(w * w + x * x + y * y + z * z - 1.0) <= _UNIT_SLIP
            and hypot(*turning) <= RATE_BOUND
            and hypot(*felt) <= ACCELERATION_BOUND
            and hypot(*load) <= WRENCH_BOUND
        ):
            return False
        self.last = {"attitude": turn, "angular_velocity": turning, "specific_force": felt, "wrench": load}
        self._wrench_stamp = stamp
        return True

    def _mend(self, frame: SensorFrame) -> tuple[SensorFrame, tuple[str, ...]]:
        changes: dict[str, Any] = {}
        last = self.last
        for name, size, bound in _VECTORS:
            numbers = _sound(getattr(frame, name), size, bound)
            if numbers is None or (size == 4 and not _unit(*numbers)):
                changes[name] = np.array(last[name])
            else:
                last[name] = numbers
        if not is_stamp(frame.wrench_stamp_ns) or frame.wrench_stamp_ns > frame.stamp_ns or "wrench" in changes:
            changes["wrench_stamp_ns"] = self._wrench_stamp
        else:
            self._wrench_stamp = frame.wrench_stamp_ns
        for name, part in (("image", frame.image), ("features", frame.features)):
            if not _dated(part):
                changes[name] = None
        if not changes:
            return frame, ()
        return dataclasses.replace(frame, **changes), tuple(f"sensor {name}: not sound" for name in changes)


def _dated(part: Any) -> bool:
    """Whether a part of a frame is absent or has a stamp."""
    return part is None or is_stamp(getattr(part, "stamp_ns", None))


def _shifted(frame: SensorFrame, shift_ns: int) -> SensorFrame:
    """The frame in the pilot's time; what has no sound stamp keeps it and is refused later."""
    changes: dict[str, Any] = {"stamp_ns": frame.stamp_ns + shift_ns}
    if is_stamp(frame.wrench_stamp_ns):
        changes["wrench_stamp_ns"] = frame.wrench_stamp_ns + shift_ns
    for name, part in (("image", frame.image), ("features", frame.features)):
        if part is None or not is_stamp(getattr(part, "stamp_ns", None)):
            continue
        moved = {"stamp_ns": part.stamp_ns + shift_ns}
        if getattr(part, "velocity_stamp_ns", 0):
            moved["velocity_stamp_ns"] = part.velocity_stamp_ns + shift_ns  # type: ignore[union-attr]
        changes[name] = dataclasses.replace(part, **moved)
    return dataclasses.replace(frame, **changes)


def _sound(value: Any, size: int, bound: float) -> list[float] | None:
    """The numbers of a float vector of that size with every entry within the bound, else None."""
    if not isinstance(value, np.ndarray) or value.shape != (size,) or value.dtype.kind != "f":
        return None
    numbers = value.tolist()
    for number in numbers:
        if not -bound <= number <= bound:  # so written that NaN fails
            return None
    return numbers


def _unit(w: float, x: float, y: float, z: float) -> bool:
    return abs(w * w + x * x + y * y + z * z - 1.0) <= _UNIT_SLIP
