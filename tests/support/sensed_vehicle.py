"""Raw sensors of the small vehicle before its wall, for a pilot without a simulator."""

from __future__ import annotations

from typing import Any

import numpy as np
from controller_scenes import TICK_NS
from small_vehicle import SmallVehicle

from ibvs_qp.config import ControllerConfig
from ibvs_qp.measurement import FeatureFrame, SensorFrame

#: Ticks between pictures: 31 Hz.
EVERY = 8


class SensedVehicle(SmallVehicle):
    """Adds an inertial unit and a force sensor with a little noise, and perception of the wall's lines."""

    def __init__(self, distance: float = 0.1) -> None:
        super().__init__(ControllerConfig(), distance=distance)
        self._rng = np.random.default_rng(0)

    def sense(self, **changes: Any) -> SensorFrame:
        """Sensors of the present tick; the tool weighs nothing, so the force sensor shows the contact alone."""
        seen = self.measure()
        stamp = (self.tick + 1) * TICK_NS
        features = None
        if self.tick % EVERY == 0:
            features = FeatureFrame(
                lines=seen.lines,
                plane=seen.plane,
                stamp_ns=stamp,
                velocity=seen.velocity,
                velocity_covariance=np.diag([1e-4, 1e-4, 1e3]),
            )
        values: dict[str, Any] = {
            "stamp_ns": stamp,
            "attitude": seen.attitude,
            "angular_velocity": seen.angular_velocity + self._rng.normal(0.0, 1e-3, 3),
            "specific_force": seen.specific_force + self._rng.normal(0.0, 0.02, 3),
            "wrench": self._rng.normal(0.0, 0.02, 6),
            "wrench_stamp_ns": stamp,
            "features": features,
        }
        return SensorFrame(**(values | changes))
