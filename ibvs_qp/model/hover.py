"""Hover without a solution or a measurement: weight compensation and level attitude from the last inertial data."""

from __future__ import annotations

import numpy as np

from allocation import control_effectiveness
from ibvs_qp.config import ControllerConfig
from ibvs_qp.frames import GRAVITY, down_in_body, ordered_product, roll_pitch
from ibvs_qp.measurement import Measurement
from ibvs_qp.model.motion_margin import TICKS_LATE

#: Attitude gain times the square of the time to act, and rate gain times it [-]: lag of the motors and delay of a
#: tick. Peak of sensitivity 1.7, and 2.1 where the motors lag 1.6 times as long. The gains of the law, stiffer by its
#: leads and filters, have 5.7 without them.
STIFFNESS, DAMPING = 0.12, 0.8


def hover_gains(config: ControllerConfig) -> tuple[float, float]:
    """Gains of roll and pitch [1/s^2], and of the rates of all three axes [1/s]."""
    slow = config.vehicle.motor_lag_s + TICKS_LATE * config.tick_s
    return STIFFNESS / slow**2, DAMPING / slow


def hold_thrusts(config: ControllerConfig, measurement: Measurement | None) -> np.ndarray:
    """Thrusts that carry the weight and level the vehicle; those of a level hover without a measurement.

    Args:
        config: The controller's configuration.
        measurement: Last accepted measurement, None before the first.

    Returns:
        Thrusts within the box [N], (n,).
    """
    vehicle = config.vehicle
    kp, kd = hover_gains(config)
    wrench = np.array([0.0, 0.0, -vehicle.mass_kg * GRAVITY, 0.0, 0.0, 0.0])
    if measurement is not None:
        roll, pitch = roll_pitch(measurement.attitude)
        omega = measurement.angular_velocity
        wrench[:3] = -vehicle.mass_kg * GRAVITY * np.array(down_in_body(measurement.attitude))
        wrench[3:] = ordered_product(vehicle.inertia, -kp * np.array([roll, pitch, 0.0]) - kd * np.asarray(omega))
    thrusts = ordered_product(np.linalg.pinv(control_effectiveness(vehicle.geometry)), wrench)
    return np.clip(thrusts, vehicle.thrust_min, vehicle.thrust_max)
