"""Inputs of the estimators and of the law, as symbols: body, contact and motors."""

from __future__ import annotations

from dataclasses import dataclass, fields

import casadi as ca

from ibvs_qp.config import VehicleParams
from ibvs_qp.symbolic.signals import Signals


@dataclass(frozen=True, kw_only=True)
class Body:
    """Inertial state and forces, in B.

    Attributes:
        dt: Time since the last step [s].
        down: Unit gravity.
        gyro: Angular velocity as measured [rad/s].
        rate: Angular velocity [rad/s]: the gyro's, in a model the estimated one (`estimated_rate`).
        specific_force: Accelerometer [m/s^2]; specific_force_known: 1 if measured.
        wrench: Tared contact wrench on the vehicle [N, N m].
        velocity: Linear velocity [m/s]; velocity_known: 1 if estimated.
        acceleration_bias: Measured minus true acceleration [m/s^2]; its part along the wall counts.
    """

    dt: ca.SX
    down: ca.SX
    gyro: ca.SX
    rate: ca.SX
    specific_force: ca.SX
    specific_force_known: ca.SX
    wrench: ca.SX
    velocity: ca.SX
    velocity_known: ca.SX
    acceleration_bias: ca.SX

    @classmethod
    def of(cls, signals: Signals) -> Body:
        """Declare the inputs."""
        gyro = signals.input("angular_velocity", 3)
        return cls(
            dt=signals.input("dt"),
            down=gravity_direction(signals.input("attitude", 4)),
            gyro=gyro,
            rate=gyro,
            specific_force=signals.input("specific_force", 3),
            specific_force_known=signals.input("specific_force_known"),
            wrench=signals.input("contact_wrench", 6),
            velocity=signals.input("velocity", 3),
            velocity_known=signals.input("velocity_known"),
            acceleration_bias=signals.input("acceleration_bias", 3),
        )

    def velocity_of(self, point: tuple[float, float, float]) -> ca.SX:
        r"""Velocity of a point of the body, :math:`v + \Omega \times p` [m/s], (3,).

        Args:
            point: The point, in B [m].
        """
        return self.velocity + ca.cross(self.rate, ca.DM(point))


@dataclass(frozen=True, kw_only=True)
class Contact:
    """Wall and contact as estimated, by the names and units of `ContactState`; true is 1.

    Attributes:
        moment_noise: Its `across_noise` [N].
        touching: Its `in_contact`.
        normal: Unit vector into the wall, in B, (3,).
    """

    known: ca.SX
    distance: ca.SX
    rate: ca.SX
    acceleration: ca.SX
    rate_noise: ca.SX
    acceleration_noise: ca.SX
    bias: ca.SX
    push: ca.SX
    push_noise: ca.SX
    moment_noise: ca.SX
    touching: ca.SX
    ramp: ca.SX
    stiffness: ca.SX
    stiffness_known: ca.SX
    normal: ca.SX

    @classmethod
    def of(cls, signals: Signals) -> Contact:
        """Declare the inputs."""
        scalars = {name: signals.input(f"contact.{name}") for name in CONTACT}
        return cls(normal=signals.input("normal", 3), **scalars)


#: Scalar inputs of the contact.
CONTACT = tuple(field.name for field in fields(Contact) if field.name != "normal")


@dataclass(frozen=True, kw_only=True)
class MotorThrust:
    """Thrusts of the motors as the lag of the last commands predicts them.

    Attributes:
        thrusts: [N], (n,).
        ready: 1 if anything was ever commanded.
    """

    thrusts: ca.SX
    ready: ca.SX


def motor_thrust(signals: Signals, vehicle: VehicleParams, dt: ca.SX) -> MotorThrust:
    """Thrusts after ``dt`` [s] of the last command, with the lags of rising and falling thrust."""
    count = vehicle.geometry.count
    last, commanded = signals.input("thrust_last", count), signals.input("commanded")
    thrusts, ready = signals.state("motor_thrust", count), signals.state("motor_ready")
    rise, fall = (1.0 - ca.exp(-dt / lag) for lag in (vehicle.motor_lag_up_s, vehicle.motor_lag_down_s))
    step = last - thrusts
    moved = ca.if_else(ready, thrusts + ca.if_else(step > 0.0, rise, fall) * step, last)
    return MotorThrust(
        thrusts=signals.remember("motor_thrust", moved), ready=signals.remember("motor_ready", commanded)
    )


def gravity_direction(attitude: ca.SX) -> ca.SX:
    """Unit gravity in B, (3,), by a quaternion; see `ibvs_qp.frames.down_in_body`."""
    w, x, y, z = ca.vertsplit(attitude)
    return ca.vertcat(2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y))
