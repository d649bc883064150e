"""Angular velocity from gyro and motors: less noise than the gyro, without the phase lag of a low-pass filter."""

from __future__ import annotations

import math

import casadi as ca
import numpy as np

from ibvs_qp.config import ControllerConfig
from ibvs_qp.model.inputs import Body
from ibvs_qp.model.motor_thrust import MotorThrust
from ibvs_qp.symbolic.signals import Signals


def estimated_rate(
    signals: Signals, config: ControllerConfig, effectiveness: np.ndarray, body: Body, motors: MotorThrust
) -> tuple[ca.SX, ca.SX]:
    r"""Angular velocity [rad/s] and acceleration [rad/s^2] in B, (3,) each.

    .. math:: \hat\alpha = J^{-1}(B_M \hat u + M_{ext} - \Omega\times J\Omega), \qquad
              \dot{\hat\Omega} = \hat\alpha + 2\pi f (\Omega - \hat\Omega)

    with the gyro Omega, the lagged thrusts :math:`\hat u`, the moments observed and fed forward at the step before, and
    f = ``angular_rate.gyro_bandwidth_hz``. Above f the motors' model counts: the rotors do not see the gyro's noise,
    and a commanded rotation is not late.
    """
    inertia = ca.sparsify(config.vehicle.inertia)
    outside = signals.state("external_moment", 3)
    if config.contact_feedforward:
        outside += signals.state("feedforward_moment", 3)
    moment = ca.DM(effectiveness[3:]) @ motors.thrusts + outside - ca.cross(body.gyro, inertia @ body.gyro)
    awake = ca.logic_and(motors.ready, body.dt > 0.0)
    acceleration = ca.if_else(awake, ca.solve(inertia, moment), 0.0)
    gain = 1.0 - ca.exp(-2.0 * math.pi * config.angular_rate.gyro_bandwidth_hz * body.dt)
    predicted = signals.state("angular_rate", 3) + body.dt * acceleration
    rate = ca.if_else(awake, predicted + gain * (body.gyro - predicted), body.gyro)
    return signals.remember("angular_rate", rate), acceleration
