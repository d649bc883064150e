"""Sensor frames: a rejected raw sensor is named and replaced by its last accepted value before any filter reads it."""

from __future__ import annotations

import dataclasses
from typing import Any, TypeVar

from ibvs_qp.measurement import FeatureFrame, RgbdFrame, SensorFrame
from ibvs_qp.validation.clock import NO_PAST_TIME, MonotonicClock
from ibvs_qp.validation.fields import SENSOR_FRAME, Field, plain_instance
from ibvs_qp.validation.numbers import described, vector, whole

Part = TypeVar("Part", RgbdFrame, FeatureFrame)


class CaptureGate:
    """Brings pictures and features into the pilot's time; untimely, repeated and invalid ones are rejected by name.

    Their contents are checked by perception, and by `ibvs_qp.validation.features`.

    Args:
        clock: Of the sensor frames.
        latest_s: A picture older than this at delivery is refused [s].
    """

    def __init__(self, clock: MonotonicClock, latest_s: float) -> None:
        self._clock, self._latest_ns = clock, round(latest_s * 1e9)
        self.reset()

    def reset(self) -> None:
        """As before the first picture."""
        self._newest = -1

    def image(self, image: Any, rejected: list[str]) -> RgbdFrame | None:
        """The picture in the pilot's time, or None; perception keeps its intrinsics, so they are copied."""
        part = self._part("image", image, RgbdFrame, rejected)
        entries = None if part is None else vector(part.intrinsics, 4)
        if part is None or entries is None:
            return part
        return dataclasses.replace(part, intrinsics=tuple(entries))

    def features(self, features: Any, rejected: list[str]) -> FeatureFrame | None:
        """The features in the pilot's time, or None; a velocity without a sound time is dropped."""
        part = self._part("features", features, FeatureFrame, rejected)
        if part is None or part.velocity is None or whole(part.velocity_stamp_ns, 0, 0) == 0:
            return part
        time = self._time("features.velocity_stamp_ns", part.velocity_stamp_ns, rejected)
        if time is None:
            return dataclasses.replace(part, velocity=None, velocity_stamp_ns=0)
        return dataclasses.replace(part, velocity_stamp_ns=self._at_latest_now(time))

    def _part(self, name: str, part: Any, kind: type[Part], rejected: list[str]) -> Part | None:
        if part is None:
            return None
        if not issubclass(type(part), kind):
            rejected.append(f"{name}: {described(part)}, not {kind.__name__}")
            return None
        part = plain_instance(part, kind)
        time = self._time(f"{name}.stamp_ns", part.stamp_ns, rejected)
        if time is None:
            return None
        if time <= self._newest:
            rejected.append(f"{name}.stamp_ns: not after the last one's")
            return None
        self._newest = time
        return dataclasses.replace(part, stamp_ns=self._at_latest_now(time))

    def _time(self, name: str, stamp: Any, rejected: list[str]) -> int | None:
        """Time of a capture; None if it is refused."""
        time = self._clock.sample_time(stamp)
        if time is None:
            rejected.append(f"{name}: {NO_PAST_TIME}")
            return None
        if self._clock.last_ns - time > self._latest_ns:
            age_s, latest_s = (self._clock.last_ns - time) * 1e-9, self._latest_ns * 1e-9
            rejected.append(f"{name}: {age_s:.3g} s old, camera.latest_s = {latest_s:g}")
            return None
        return time

    def _at_latest_now(self, time: int) -> int:
        """A stamp slightly ahead counts as that of the tick: no filter has a later state."""
        return min(time, self._clock.last_ns)


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
        self._stamps: dict[str, int] = {}
        self.replaced = set[str]()

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
        self.last, _, self.replaced = SENSOR_FRAME.read(frame, self.last, rejected)
        times = {name: self._time(frame, name, row, rejected) for name, row in SENSOR_FRAME.stamps.items()}
        image = self._captures.image(frame.image, rejected)
        features = frame.features
        if image is not None and features is not None:
            rejected.append("features: not used together with an image")
            features = None
        checked = SensorFrame(
            stamp_ns=self.clock.last_ns,
            image=image,
            features=self._captures.features(features, rejected),
            **times,
            **SENSOR_FRAME.values(self.last),
        )
        return checked, tuple([f"sensor {reason}" for reason in rejected])

    def _time(self, frame: SensorFrame, name: str, row: Field, rejected: list[str]) -> int | None:
        """Time of a sample, None for at the tick; that of the last accepted one where stamp or sample is refused.

        A sample that is not held needs a time within its greatest age: it is dropped otherwise.
        """
        stamp, optional = getattr(frame, name), name in SENSOR_FRAME.optional_stamps
        if (stamp is None and optional) or not (row.held or self.last[row.name]):
            return None
        time = self.clock.sample_time(stamp)
        if time is None:
            rejected.append(f"{name}: {NO_PAST_TIME}")
        elif optional or row.name not in self.replaced:
            self._stamps[name] = time
        if row.held:
            return self._stamps.get(name, 0)
        if time is not None and (age_s := (self.clock.last_ns - time) * 1e-9) > row.oldest_s:
            rejected.append(f"{row.name}: {age_s:.3g} s old, at most {row.oldest_s:g} s")
            time = None
        if time is None:
            self.last[row.name] = None
        return time
