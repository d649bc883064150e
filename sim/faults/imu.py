"""Faults of the inertial unit: gyro, accelerometer and attitude estimate."""

from __future__ import annotations

import dataclasses
import math
from collections import deque
from dataclasses import dataclass
from typing import Any

import numpy as np

from ibvs_qp.config.settings import choice, setting
from ibvs_qp.measurement import SensorFrame
from ibvs_qp.quaternion import multiply
from sim.faults.fault import FrameFilter, SensorFault

#: Outputs of the unit, with the entries of each.
OUTPUTS = {"attitude": 4, "angular_velocity": 3, "specific_force": 3}


@dataclass(frozen=True, kw_only=True)
class ImuStuck(SensorFault):
    """The same values again and again."""

    fresh: bool = setting(True, "with fresh stamps; otherwise with the old ones: no new samples come")

    def filter(self, rng: np.random.Generator) -> FrameFilter:
        """Repeat the values of the first frame."""
        last: dict[str, Any] = {}

        def stuck(frame: SensorFrame) -> SensorFrame:
            if not last:
                last.update({name: getattr(frame, name).copy() for name in OUTPUTS})
                if not self.fresh:
                    last.update({name: frame.stamp_ns for name in ("attitude_stamp_ns", "imu_stamp_ns")})
            return dataclasses.replace(frame, **last)

        return stuck


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
            values = {name: getattr(old, name) for name in OUTPUTS}
            stamps = {"attitude_stamp_ns": old.stamp_ns, "imu_stamp_ns": old.stamp_ns}
            return dataclasses.replace(frame, **values, **stamps)

        return late


@dataclass(frozen=True, kw_only=True)
class ImuNan(SensorFault):
    """Values that are no numbers."""

    output: str = choice("all", "outputs that are NaN", ("all", *OUTPUTS))

    def filter(self, rng: np.random.Generator) -> FrameFilter:
        """NaN in every entry."""
        bad: dict[str, Any] = {
            name: np.full(size, math.nan) for name, size in OUTPUTS.items() if self.output in ("all", name)
        }
        return lambda frame: dataclasses.replace(frame, **bad)


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
