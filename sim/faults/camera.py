"""Faults of the camera's delivery: pictures, or the features of pictures, lost, late, out of order or frozen."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

import numpy as np

from ibvs_qp.config.settings import setting
from ibvs_qp.measurement import FeatureFrame, RgbdFrame, SensorFrame
from sim.faults.fault import FrameFilter, SensorFault

#: A picture, or the result of perception for one.
Picture = RgbdFrame | FeatureFrame
_NS = 1e9


def picture_of(frame: SensorFrame) -> Picture | None:
    """The new picture of a frame, or its features."""
    return frame.image if frame.image is not None else frame.features


def with_picture(frame: SensorFrame, picture: Picture | None) -> SensorFrame:
    """The frame with another picture, or another frame's features."""
    if picture is picture_of(frame):
        return frame
    image = picture if isinstance(picture, RgbdFrame) else None
    return dataclasses.replace(frame, image=image, features=picture if isinstance(picture, FeatureFrame) else None)


def restamped(picture: Picture, stamp_ns: int) -> Picture:
    """The picture as if captured at another time: its own stamps moved alike."""
    if isinstance(picture, RgbdFrame):
        return dataclasses.replace(picture, stamp_ns=stamp_ns)
    later = stamp_ns - picture.stamp_ns
    changes: dict[str, Any] = {
        "stamp_ns": stamp_ns,
        "lines": tuple(dataclasses.replace(line, stamp_ns=line.stamp_ns + later) for line in picture.lines),
    }
    if picture.velocity_stamp_ns:
        changes["velocity_stamp_ns"] = picture.velocity_stamp_ns + later
    return dataclasses.replace(picture, **changes)


@dataclass(frozen=True, kw_only=True)
class CameraLost(SensorFault):
    """No pictures."""

    def filter(self, rng: np.random.Generator) -> FrameFilter:
        """Take every picture out."""
        return lambda frame: with_picture(frame, None)


@dataclass(frozen=True, kw_only=True)
class CameraLatency(SensorFault):
    """Pictures come later, in their order, with their true stamps."""

    extra_s: float = setting(0.14, "delay beyond the usual one", unit="s", low=0.0, high=5.0)
    jitter_s: float = setting(0.0, "largest further delay, uniform", unit="s", low=0.0, high=5.0)

    def filter(self, rng: np.random.Generator) -> FrameFilter:
        """Hold every picture for its delay."""
        line: list[tuple[int, Picture]] = []

        def delayed(frame: SensorFrame) -> SensorFrame:
            picture = picture_of(frame)
            if picture is not None:
                line.append((frame.stamp_ns + round((self.extra_s + self.jitter_s * rng.random()) * _NS), picture))
            return with_picture(frame, line.pop(0)[1] if line and line[0][0] <= frame.stamp_ns else None)

        return delayed


@dataclass(frozen=True, kw_only=True)
class CameraJitter(CameraLatency):
    """Pictures come with a random further delay."""

    extra_s: float = setting(0.0, "delay beyond the usual one", unit="s", low=0.0, high=5.0)
    jitter_s: float = setting(0.1, "largest further delay, uniform", unit="s", low=0.0, high=5.0)


@dataclass(frozen=True, kw_only=True)
class CameraReordered(SensorFault):
    """Of every two pictures the older one comes a tick after the newer one."""

    def filter(self, rng: np.random.Generator) -> FrameFilter:
        """Hold every other picture until its successor has come."""
        held: list[Picture] = []
        overtaken: list[Picture] = []

        def swapped(frame: SensorFrame) -> SensorFrame:
            picture = picture_of(frame)
            if picture is None:
                return with_picture(frame, overtaken.pop() if overtaken else None)
            if not held:
                held.append(picture)
                return with_picture(frame, None)
            overtaken.append(held.pop())
            return frame

        return swapped


@dataclass(frozen=True, kw_only=True)
class CameraFrozen(SensorFault):
    """The same picture again and again, with fresh stamps."""

    def filter(self, rng: np.random.Generator) -> FrameFilter:
        """Repeat the first picture."""
        first: list[Picture] = []

        def frozen(frame: SensorFrame) -> SensorFrame:
            picture = picture_of(frame)
            if picture is None:
                return frame
            first[:] = first or [picture]
            return with_picture(frame, restamped(first[0], picture.stamp_ns))

        return frozen
