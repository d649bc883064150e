"""Pictures and features of a sensor frame: their types, and their times of capture."""

from __future__ import annotations

import dataclasses
from typing import Any, TypeVar

from ibvs_qp.measurement import FeatureFrame, RgbdFrame
from ibvs_qp.validation.clock import NO_PAST_TIME, MonotonicClock
from ibvs_qp.validation.fields import plain_instance
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
