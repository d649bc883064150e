"""How far the vehicle can push: a ray in wrench space until the first rotor leaves its limits."""

from __future__ import annotations

import casadi as ca
import numpy as np

from allocation.wrench_facets import WrenchFacets
from ibvs_qp.setpoints.signals import Signals
from ibvs_qp.vehicle import VehicleParams

#: Share of the reach that a push may ask for: the rest is left for holding place, whatever the vehicle can do.
REACH_SHARE = 0.97
#: Reach given out when nothing bounds it [N].
UNBOUNDED = 1e6
#: Commanded speed below which the tip counts as standing still [m/s]: what a drifting odometer wishes is no slide.
STANDING_SPEED = 1e-2
#: Thrust per newton of push below which a rotor does not mind.
IDLE_SLOPE = 1e-9


def push_reach(
    signals: Signals,
    vehicle: VehicleParams,
    normal: ca.SX,
    travel: ca.SX,
    friction: ca.SX,
    static_wrench: ca.SX,
) -> ca.SX:
    r"""Largest push that the limits in force can hold, level, against friction along the commanded travel [N].

    The ray :math:`w(f) = f [d; p \times d] - h`, :math:`d = n + \mu t`, meets the facets of the attainable wrench set
    (`allocation.wrench_facets`); the reach is the first f at which it leaves. Exact for any number of rotors.
    """
    facets, count = WrenchFacets(vehicle.geometry), vehicle.geometry.count
    low, high = signals.input("thrust_low", count), signals.input("thrust_high", count)
    speed = ca.norm_2(travel)
    direction = normal + ca.if_else(speed > STANDING_SPEED, friction / ca.fmax(speed, STANDING_SPEED), 0.0) * travel
    lever = ca.cross(ca.DM(vehicle.tip_position_m), direction)
    slope = ca.DM(facets.normals) @ ca.vertcat(direction, lever)
    rising, falling = ca.DM(np.maximum(facets.shares, 0.0)), ca.DM(np.minimum(facets.shares, 0.0))
    held = -(ca.DM(facets.normals) @ static_wrench)
    upper, lower = rising @ high + falling @ low - held, rising @ low + falling @ high - held
    room = ca.if_else(slope > 0.0, upper, lower) / ca.if_else(ca.fabs(slope) > IDLE_SLOPE, slope, 1.0)
    room = ca.if_else(ca.fabs(slope) > IDLE_SLOPE, room, UNBOUNDED)
    return signals.output("reach", ca.fmax(ca.mmin(room), 0.0))
