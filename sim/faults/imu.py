"""Faults of the inertial unit: gyro, accelerometer and attitude estimate."""

from __future__ import annotations

import dataclasses
import math
from collections import deque
from dataclasses import dataclass
from typing import Any

import numpy as np

from ibvs_qp.config.settings import choice, setting
from ibvs_qp.estimation.estimator import INERTIAL
from ibvs_qp.measurement import SensorFrame, channels
from ibvs_qp.quaternion import multiply
from sim.faults.fault import FrameFilter, SensorFault, not_numbers, repeated

#: Stamps of the samples of the unit.
_STAMPS = tuple([channels(SensorFrame)[name].stamp for name in INERTIAL])


@dataclass(frozen=True, kw_only=True)
class ImuStuck(SensorFault):
    """The same values again and again."""

    fresh: bool = setting(True, "with fresh stamps; otherwise with the old ones: no new samples come")

    def filter(self, rng: np.random.Generator) -> FrameFilter:
        """Repeat the values of the first frame."""
        return repeated(INERTIAL, stamps=not self.fresh)


@dataclass(frozen=True, kw_only=True)
class ImuLate(SensorFault):
    """Samples arrive late, with the stamps of when they were taken."""

    latency_s: float = setting(0.2, "time from sample to delivery", unit="s", low=0.0, high=2.0)

    def filter(self, rng: np.random.Generator) -> FrameFilter:
        """Deliver the sample of then, or the oldest since the fault began."""
        taken = deque[SensorFrame]()

        def late(frame: SensorFrame) -> SensorFrame:
            taken.append(frame)
            while len(taken) > 1 and taken[1].stamp_ns <= frame.stamp_ns - round(1e9 * self.latency_s):
                taken.popleft()
            old = taken[0]
            values: dict[str, Any] = {name: getattr(old, name) for name in INERTIAL}
            return dataclasses.replace(frame, **values, **dict.fromkeys(_STAMPS, old.stamp_ns))

        return late


@dataclass(frozen=True, kw_only=True)
class ImuNan(SensorFault):
    """Values that are no numbers."""

    output: str = choice("all", "the invalid output", ("all", *INERTIAL))

    def filter(self, rng: np.random.Generator) -> FrameFilter:
        """NaN in every entry."""
        return not_numbers(INERTIAL if self.output == "all" else (self.output,))


@dataclass(frozen=True, kw_only=True)
class GyroBias(SensorFault):
    """A rate is added; the attitude estimate stays as it is."""

    rate_deg_s: tuple[float, float, float] = setting((3.0, 0.0, 0.0), "FRD", unit="deg/s", low=-360.0, high=360.0)

    def filter(self, rng: np.random.Generator) -> FrameFilter:
        """Add it."""
        bias = np.radians(self.rate_deg_s)
        return lambda frame: dataclasses.replace(frame, angular_velocity=frame.angular_velocity + bias)


@dataclass(frozen=True, kw_only=True)
class AttitudeStep(SensorFault):
    """The attitude estimate is turned."""

    turn_deg: tuple[float, float, float] = setting((3.0, 0.0, 0.0), "roll, pitch, yaw", unit="deg", low=-90, high=90)

    def filter(self, rng: np.random.Generator) -> FrameFilter:
        """Turn it in the body's axes, one angle after the other."""
        turn = (1.0, 0.0, 0.0, 0.0)
        for axis, degrees in enumerate(self.turn_deg):
            half = 0.5 * math.radians(degrees)
            about = [math.cos(half), 0.0, 0.0, 0.0]
            about[axis + 1] = math.sin(half)
            turn = multiply(turn, about)
        return lambda frame: dataclasses.replace(frame, attitude=np.array(multiply(frame.attitude.tolist(), turn)))


@dataclass(frozen=True, kw_only=True)
class AccelerometerBias(SensorFault):
    """A specific force is added."""

    force_m_s2: tuple[float, float, float] = setting((0.5, 0.0, 0.0), "FRD", unit="m/s^2", low=-100.0, high=100.0)

    def filter(self, rng: np.random.Generator) -> FrameFilter:
        """Add it."""
        bias = np.array(self.force_m_s2)
        return lambda frame: dataclasses.replace(frame, specific_force=frame.specific_force + bias)
