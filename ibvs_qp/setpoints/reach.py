"""How far the vehicle can push: a ray in wrench space until the first rotor leaves its limits."""

from __future__ import annotations

import casadi as ca
import numpy as np

from ibvs_qp.setpoints.signals import Signals
from ibvs_qp.vehicle import VehicleParams

#: A wanted push below the reach keeps this much margin [N].
REACH_MARGIN = 1.0
#: Reach given out when nothing bounds it [N].
UNBOUNDED = 1e6
#: Commanded speed below which the tip counts as standing still [m/s].
STANDING_SPEED = 1e-3
#: Thrust per newton of push below which a rotor does not mind.
IDLE_SLOPE = 1e-9


def push_reach(
    signals: Signals,
    vehicle: VehicleParams,
    inverse: np.ndarray,
    normal: ca.SX,
    travel: ca.SX,
    friction: ca.SX,
    static_wrench: ca.SX,
) -> ca.SX:
    r"""Largest push that the limits in force can hold, level, against friction along the commanded travel [N].

    Thrusts along the ray: :math:`u(f) = B^+ (f [d; p \times d] - h)` with :math:`d = n + \mu t`; the reach is the
    first f at which one of them meets its limit.
    """
    count = vehicle.geometry.count
    low, high = signals.input("thrust_low", count), signals.input("thrust_high", count)
    speed = ca.norm_2(travel)
    direction = normal + ca.if_else(speed > STANDING_SPEED, friction / ca.fmax(speed, STANDING_SPEED), 0.0) * travel
    lever = ca.cross(ca.DM(vehicle.tip_position_m), direction)
    slope = ca.DM(inverse) @ ca.vertcat(direction, lever)
    base = -(ca.DM(inverse) @ static_wrench)
    room = ca.if_else(slope > 0.0, high - base, low - base) / ca.if_else(ca.fabs(slope) > IDLE_SLOPE, slope, 1.0)
    room = ca.if_else(ca.fabs(slope) > IDLE_SLOPE, room, UNBOUNDED)
    return signals.output("reach", clamp_positive(ca.mmin(room)))


def clamp_positive(value: ca.SX) -> ca.SX:
    """Value, at least zero."""
    return ca.fmax(value, 0.0)
