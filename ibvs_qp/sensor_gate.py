"""What may enter the pilot's estimators: an unsound raw sensor is named and replaced by its last good value."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from ibvs_qp.gate import ACCELERATION_BOUND, RATE_BOUND, WRENCH_BOUND, is_stamp
from ibvs_qp.measurement import SensorFrame

#: Name, size and largest believable entry of every raw vector.
_VECTORS = (
    ("attitude", 4, 1.01),
    ("angular_velocity", 3, RATE_BOUND),
    ("specific_force", 3, ACCELERATION_BOUND),
    ("wrench", 6, WRENCH_BOUND),
)


class SensorGate:
    """Passes sound frames on untouched; one NaN in a filter would stay there for the rest of the flight.

    Attributes:
        last: Last good numbers of every raw vector by name, the present ones where they are sound.
    """

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Forget the last good values; level and still stands in for what was never seen."""
        self.last: dict[str, list[float]] = {
            "attitude": [1.0, 0.0, 0.0, 0.0],
            "angular_velocity": [0.0] * 3,
            "specific_force": [0.0, 0.0, -9.81],
            "wrench": [0.0] * 6,
        }
        self._stamp = -1
        self._wrench_stamp = 0

    def check(self, frame: Any) -> tuple[SensorFrame | None, tuple[str, ...]]:
        """A frame that is safe to filter, or None when it has no sound time, and the names of what was refused."""
        if not isinstance(frame, SensorFrame) or not is_stamp(frame.stamp_ns) or frame.stamp_ns <= self._stamp:
            return None, ("sensor frame: stamp_ns not after the last one",)
        self._stamp = frame.stamp_ns
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
            if part is not None and not is_stamp(getattr(part, "stamp_ns", None)):
                changes[name] = None
        if not changes:
            return frame, ()
        return dataclasses.replace(frame, **changes), tuple(f"sensor {name}: not sound" for name in changes)


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
    return abs(w * w + x * x + y * y + z * z - 1.0) <= 0.02
