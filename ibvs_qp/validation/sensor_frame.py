"""Sensor frames: a rejected raw sensor is named and replaced by its last accepted value before any filter reads it."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from ibvs_qp.measurement import SensorFrame
from ibvs_qp.validation.clock import MonotonicClock, is_stamp
from ibvs_qp.validation.fields import SENSOR_FRAME


class SensorGate:
    """Checks sensor frames for the pilot; one NaN in a filter would stay there for the rest of the flight.

    Attributes:
        last: Last accepted numbers of every raw vector by name; those of the present frame where it is good.
        clock: Maps the frames' stamps to the pilot's monotonic time.
        replaced: Names of what the last frame lacked.
    """

    def __init__(self) -> None:
        self.clock = MonotonicClock()
        self.reset()

    def reset(self) -> None:
        """Forget the accepted values; level and at rest until the first ones."""
        self.clock.reset()
        self.last = SENSOR_FRAME.fallbacks
        self._wrench_stamp = 0
        self.replaced: tuple[str, ...] = ()

    def check(self, frame: Any) -> tuple[SensorFrame | None, tuple[str, ...]]:
        """The frame in the pilot's time with rejected sensors replaced, and what was rejected.

        Returns:
            None for the frame when its stamp is refused.
        """
        why = self.clock.accept(frame.stamp_ns) if isinstance(frame, SensorFrame) else "not in a sensor frame"
        if why:
            return None, (f"sensor frame: stamp_ns {why}",)
        if self.clock.shift_ns:
            frame = _shifted(frame, self.clock.shift_ns)
        changes: dict[str, Any] = {field.name: np.array(self.last[field.name]) for field in SENSOR_FRAME.faults(frame)}
        self.last = SENSOR_FRAME.entries(frame, changes, self.last)
        stamp = frame.wrench_stamp_ns
        if "wrench" not in changes and is_stamp(stamp) and stamp <= frame.stamp_ns:
            self._wrench_stamp = stamp
        else:
            changes["wrench_stamp_ns"] = self._wrench_stamp
        for name, part in (("image", frame.image), ("features", frame.features)):
            if part is not None and not is_stamp(getattr(part, "stamp_ns", None)):
                changes[name] = None
        self.replaced = tuple(changes)
        if not changes:
            return frame, ()
        return dataclasses.replace(frame, **changes), tuple(f"sensor {name}: not sound" for name in changes)


def _shifted(frame: SensorFrame, shift_ns: int) -> SensorFrame:
    """The frame in the pilot's time; an invalid stamp stays and is rejected later."""
    changes: dict[str, Any] = {"stamp_ns": frame.stamp_ns + shift_ns}
    if is_stamp(frame.wrench_stamp_ns):
        changes["wrench_stamp_ns"] = frame.wrench_stamp_ns + shift_ns
    for name, part in (("image", frame.image), ("features", frame.features)):
        if part is None or not is_stamp(getattr(part, "stamp_ns", None)):
            continue
        stamps = {"stamp_ns": part.stamp_ns + shift_ns}
        if velocity_stamp := getattr(part, "velocity_stamp_ns", 0):
            stamps["velocity_stamp_ns"] = velocity_stamp + shift_ns
        changes[name] = dataclasses.replace(part, **stamps)
    return dataclasses.replace(frame, **changes)
