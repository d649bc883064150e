"""Sensor frames: a rejected raw sensor is named and replaced by its last accepted value before any filter reads it."""

from __future__ import annotations

from typing import Any

from ibvs_qp.measurement import SensorFrame
from ibvs_qp.validation.capture import CaptureGate
from ibvs_qp.validation.clock import NO_PAST_TIME, MonotonicClock
from ibvs_qp.validation.fields import SENSOR_FRAME, plain_instance


class SensorGate:
    """Checks sensor frames for the pilot; one NaN in a filter would stay there for the rest of the flight.

    Args:
        latest_s: Pictures and features older than this at delivery are refused [s].

    Attributes:
        last: Last accepted numbers of every raw vector by name; those of the present frame where it is good.
        clock: Maps the frames' stamps to the pilot's monotonic time.
        replaced: Names of the raw vectors that the last frame lacked.
    """

    def __init__(self, latest_s: float) -> None:
        self.clock = MonotonicClock()
        self._captures = CaptureGate(self.clock, latest_s)
        self.reset()

    def reset(self) -> None:
        """Forget the accepted values; level and at rest until the first ones."""
        self.clock.reset()
        self._captures.reset()
        self.last = SENSOR_FRAME.fallbacks
        self._wrench_stamp, self._stamps = 0, dict[str, int]()
        self.replaced: tuple[str, ...] = ()

    def check(self, frame: Any) -> tuple[SensorFrame | None, tuple[str, ...]]:
        """A copy of the frame in the pilot's time with rejected sensors replaced, and the rejections.

        Returns:
            None for the frame when its stamp is refused.
        """
        if not issubclass(type(frame), SensorFrame):
            return None, ("sensor frame: not a SensorFrame",)
        frame = plain_instance(frame, SensorFrame)
        if why := self.clock.accept(frame.stamp_ns):
            return None, (f"sensor frame: stamp_ns {why}",)
        rejected: list[str] = []
        self.last, _, refused = SENSOR_FRAME.read(frame, self.last, rejected)
        self.replaced = tuple(refused)
        wrench_time = self._time("wrench_stamp_ns", frame.wrench_stamp_ns, rejected)
        if wrench_time is not None and "wrench" not in refused:
            self._wrench_stamp = wrench_time
        image = self._captures.image(frame.image, rejected)
        features = frame.features
        if image is not None and features is not None:
            rejected.append("features: not used together with an image")
            features = None
        checked = SensorFrame(
            stamp_ns=self.clock.last_ns,
            wrench_stamp_ns=self._wrench_stamp,
            attitude_stamp_ns=self._optional_time("attitude_stamp_ns", frame.attitude_stamp_ns, rejected),
            imu_stamp_ns=self._optional_time("imu_stamp_ns", frame.imu_stamp_ns, rejected),
            image=image,
            features=self._captures.features(features, rejected),
            **SENSOR_FRAME.values(self.last),
        )
        return checked, tuple([f"sensor {reason}" for reason in rejected])

    def _time(self, name: str, stamp: Any, rejected: list[str]) -> int | None:
        """Time of a stamp; None for a refused one."""
        time = self.clock.sample_time(stamp)
        if time is None:
            rejected.append(f"{name}: {NO_PAST_TIME}")
        return time

    def _optional_time(self, name: str, stamp: Any, rejected: list[str]) -> int | None:
        """Time of a stamp that may be None: at the tick; a refused one is replaced by the last accepted one."""
        if stamp is None:
            return None
        if (time := self._time(name, stamp, rejected)) is not None:
            self._stamps[name] = time
        return self._stamps.get(name, 0)
