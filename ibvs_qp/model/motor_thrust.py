"""Thrusts that the motors give now, by their first-order lag."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from ibvs_qp.config import VehicleParams
from ibvs_qp.symbolic.signals import Signals


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
