"""Faults of the force/torque sensor."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

import numpy as np

from ibvs_qp.config.settings import setting
from ibvs_qp.measurement import SensorFrame
from sim.faults.fault import FrameFilter, SensorFault


@dataclass(frozen=True, kw_only=True)
class ForceTorqueLost(SensorFault):
    """No new samples: the last one with its old stamp."""

    def filter(self, rng: np.random.Generator) -> FrameFilter:
        """Repeat sample and stamp of the first frame."""
        last: list[tuple[np.ndarray, int]] = []

        def lost(frame: SensorFrame) -> SensorFrame:
            last[:] = last or [(frame.wrench.copy(), frame.wrench_stamp_ns)]
            wrench, stamp_ns = last[0]
            return dataclasses.replace(frame, wrench=wrench, wrench_stamp_ns=stamp_ns)

        return lost


@dataclass(frozen=True, kw_only=True)
class ForceTorqueStuck(SensorFault):
    """The same sample again and again, with fresh stamps."""

    def filter(self, rng: np.random.Generator) -> FrameFilter:
        """Repeat the sample of the first frame."""
        last: list[np.ndarray] = []

        def stuck(frame: SensorFrame) -> SensorFrame:
            last[:] = last or [frame.wrench.copy()]
            return dataclasses.replace(frame, wrench=last[0])

        return stuck


@dataclass(frozen=True, kw_only=True)
class ForceTorqueNan(SensorFault):
    """Samples that are no numbers."""

    def filter(self, rng: np.random.Generator) -> FrameFilter:
        """NaN in all six entries."""
        return lambda frame: dataclasses.replace(frame, wrench=np.full(6, math.nan))


@dataclass(frozen=True, kw_only=True)
class ForceTorqueZero(SensorFault):
    """Samples of zero."""

    def filter(self, rng: np.random.Generator) -> FrameFilter:
        """Zero in all six entries."""
        return lambda frame: dataclasses.replace(frame, wrench=np.zeros(6))


@dataclass(frozen=True, kw_only=True)
class ForceTorqueBias(SensorFault):
    """A force is added; for a few milliseconds it is a spike."""

    force_n: tuple[float, float, float] = setting(
        (4.0, 0.0, 0.0), "the force, FRD, vehicle on tool: a push reads +x", unit="N", low=-1e3, high=1e3
    )

    def filter(self, rng: np.random.Generator) -> FrameFilter:
        """Add it."""
        bias = np.array((*self.force_n, 0.0, 0.0, 0.0))
        return lambda frame: dataclasses.replace(frame, wrench=frame.wrench + bias)
