"""Hover without a solution or a measurement: weight compensation and level attitude from the last inertial data."""

from __future__ import annotations

import numpy as np

from allocation.effectiveness import control_effectiveness
from ibvs_qp.config import ControllerConfig
from ibvs_qp.frames import GRAVITY, down_in_body, roll_pitch
from ibvs_qp.measurement import Measurement


def hold_thrusts(config: ControllerConfig, measurement: Measurement | None) -> np.ndarray:
    """Thrusts that carry the weight and level the vehicle; those of a level hover without a measurement.

    Args:
        config: The controller's configuration.
        measurement: Last accepted measurement, None before the first.

    Returns:
        Thrusts within the box [N], (n,).
    """
    vehicle, gains = config.vehicle, config.gains
    wrench = np.array([0.0, 0.0, -vehicle.mass_kg * GRAVITY, 0.0, 0.0, 0.0])
    if measurement is not None:
        roll, pitch = roll_pitch(measurement.attitude)
        omega = measurement.angular_velocity
        wrench[:3] = -vehicle.mass_kg * GRAVITY * np.array(down_in_body(measurement.attitude))
        wrench[3:] = vehicle.inertia @ np.array(
            [
                -gains.attitude_kp * roll - gains.attitude_kd * omega[0],
                -gains.attitude_kp * pitch - gains.attitude_kd * omega[1],
                -gains.yaw_kd * omega[2],
            ]
        )
    thrusts = np.linalg.pinv(control_effectiveness(vehicle.geometry)) @ wrench
    return np.clip(thrusts, vehicle.thrust_min, vehicle.thrust_max)
