"""Faults of the force/torque sensor."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from ibvs_qp.config.settings import setting
from sim.faults.fault import FrameFilter, SensorFault, not_numbers, repeated


@dataclass(frozen=True, kw_only=True)
class ForceTorqueLost(SensorFault):
    """No new samples: the last one with its old stamp."""

    def filter(self, rng: np.random.Generator) -> FrameFilter:
        """Repeat sample and stamp of the first frame."""
        return repeated(("wrench",), stamps=True)


@dataclass(frozen=True, kw_only=True)
class ForceTorqueStuck(SensorFault):
    """The same sample again and again, with fresh stamps."""

    def filter(self, rng: np.random.Generator) -> FrameFilter:
        """Repeat the sample of the first frame."""
        return repeated(("wrench",), stamps=False)


@dataclass(frozen=True, kw_only=True)
class ForceTorqueNan(SensorFault):
    """Samples that are no numbers."""

    def filter(self, rng: np.random.Generator) -> FrameFilter:
        """NaN in all six entries."""
        return not_numbers(("wrench",))


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
