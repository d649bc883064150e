"""Faults of time: a clock that jumps, a control loop that stalls, leaves ticks out, or runs slowly."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

import numpy as np

from ibvs_qp.config.settings import setting
from ibvs_qp.measurement import SensorFrame
from ibvs_qp.validation.fields import SENSOR_FRAME
from sim.faults.camera import picture_of, restamped, with_picture
from sim.faults.fault import FrameFilter, SensorFault

_NS = 1e9


@dataclass(frozen=True, kw_only=True)
class ClockJump(SensorFault):
    """All stamps taken from now on are off; samples taken before keep theirs."""

    offset_s: float = setting(3600.0, "the jump", unit="s", low=-1e9, high=1e9)

    def filter(self, rng: np.random.Generator) -> FrameFilter:
        """Move the stamps of tick, sample and picture."""
        offset, since = round(self.offset_s * _NS), []

        def moved(frame: SensorFrame) -> SensorFrame:
            since[:] = since or [frame.stamp_ns]
            stamps: dict[str, Any] = {"stamp_ns": frame.stamp_ns + offset}
            for name in SENSOR_FRAME.stamps:
                stamp = getattr(frame, name)
                if stamp is not None and stamp >= since[0]:
                    stamps[name] = stamp + offset
            picture = picture_of(frame)
            if picture is not None and picture.stamp_ns >= since[0]:
                frame = with_picture(frame, restamped(picture, picture.stamp_ns + offset))
            return dataclasses.replace(frame, **stamps)

        return moved


@dataclass(frozen=True, kw_only=True)
class LoopStall(SensorFault):
    """No ticks of the pilot: the rotors hold their last command."""

    duration_s: float | None = setting(0.5, "length of the stall", unit="s", low=1e-3, high=600.0)

    def filter(self, rng: np.random.Generator) -> FrameFilter:
        """Leave every tick out."""
        return lambda frame: None


@dataclass(frozen=True, kw_only=True)
class TicksSkipped(SensorFault):
    """Some ticks of the pilot do not take place."""

    share: float = setting(0.2, "fraction of the ticks", low=0.0, high=0.99)

    def filter(self, rng: np.random.Generator) -> FrameFilter:
        """Leave ticks out at random."""
        return lambda frame: None if rng.random() < self.share else frame


@dataclass(frozen=True, kw_only=True)
class SlowLoop(SensorFault):
    """The pilot ticks more slowly."""

    rate_hz: float = setting(50.0, "its rate", unit="Hz", low=1.0, high=250.0)

    def filter(self, rng: np.random.Generator) -> FrameFilter:
        """Leave ticks out until the next one is due."""
        due: list[float] = []

        def slow(frame: SensorFrame) -> SensorFrame | None:
            due[:] = due or [frame.stamp_ns]
            if frame.stamp_ns < due[0]:
                return None
            due[0] += _NS / self.rate_hz
            return frame

        return slow
