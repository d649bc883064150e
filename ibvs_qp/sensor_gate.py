"""What may enter the pilot's estimators: an unsound raw sensor is named and replaced by its last good value."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from ibvs_qp.gate import ACCELERATION_BOUND, RATE_BOUND, WRENCH_BOUND, is_stamp, sound_vector
from ibvs_qp.measurement import SensorFrame

#: Size and largest believable norm of every raw vector.
_VECTORS = {
    "angular_velocity": (3, RATE_BOUND),
    "specific_force": (3, ACCELERATION_BOUND),
    "wrench": (6, WRENCH_BOUND),
}


class SensorGate:
    """Passes sound frames on untouched; one NaN in a filter would stay there for the rest of the flight."""

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Forget the last good values; level and still stands in for what was never seen."""
        self._last: dict[str, np.ndarray] = {
            "attitude": np.array([1.0, 0.0, 0.0, 0.0]),
            "angular_velocity": np.zeros(3),
            "specific_force": np.array([0.0, 0.0, -9.81]),
            "wrench": np.zeros(6),
        }
        self._stamp = -1
        self._wrench_stamp = 0

    def check(self, frame: Any) -> tuple[SensorFrame | None, tuple[str, ...]]:
        """A frame that is safe to filter, or None when it has no sound time, and the names of what was refused."""
        if not isinstance(frame, SensorFrame) or not is_stamp(frame.stamp_ns) or frame.stamp_ns <= self._stamp:
            return None, ("sensor frame: stamp_ns not after the last one",)
        self._stamp = frame.stamp_ns
        changes: dict[str, Any] = {}
        attitude = frame.attitude
        if sound_vector(attitude, 4, 1.01) and abs(float(attitude @ attitude) - 1.0) <= 0.02:
            self._last["attitude"] = attitude.copy()
        else:
            changes["attitude"] = self._last["attitude"]
        for name, (size, bound) in _VECTORS.items():
            value = getattr(frame, name)
            if sound_vector(value, size, bound):
                self._last[name] = value.copy()
            else:
                changes[name] = self._last[name]
        if not is_stamp(frame.wrench_stamp_ns) or frame.wrench_stamp_ns > frame.stamp_ns or "wrench" in changes:
            changes["wrench_stamp_ns"] = self._wrench_stamp
        else:
            self._wrench_stamp = frame.wrench_stamp_ns
        for name in ("image", "features"):
            part = getattr(frame, name)
            if part is not None and not is_stamp(getattr(part, "stamp_ns", None)):
                changes[name] = None
        if not changes:
            return frame, ()
        return dataclasses.replace(frame, **changes), tuple(f"sensor {name}: not sound" for name in changes)
