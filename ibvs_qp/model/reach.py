"""Reach within the rotors' limits: thrust window of a step, largest and least push, and the push reference."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from allocation.wrench_facets import ON_PLANE, RELATIVE_ZERO, WrenchFacets
from ibvs_qp.config import ControllerConfig, VehicleParams
from ibvs_qp.estimation.inputs import Body, Contact
from ibvs_qp.model.inputs import Target
from ibvs_qp.symbolic.logic import clamp
from ibvs_qp.symbolic.signals import Signals

#: Reach when nothing bounds it [N].
UNBOUNDED = 1e6
#: Least push when the vehicle can hold none, not even zero [N].
NO_PUSH = 2.0 * UNBOUNDED
#: Commanded speed below which the tip counts as standing still [m/s]: a drifting odometer commands no slide.
STANDING_SPEED = 1e-2
#: Fraction of the reach that a push may use; the rest holds the vehicle in place.
REACH_FRACTION = 0.97
#: Fastest fall and rise of the reference in contact [N/s]: a fall follows a thrust limit that was just lowered.
FALL, RISE = 60.0, 10.0
#: Least distance between lower and upper bound [N]: OSQP takes a row for an equality below 1e-4 and refactorises.
LEAST_GAP = 1e-3


@dataclass(frozen=True, kw_only=True)
class PushPlanes:
    r"""Planes of the attainable wrench set, along the push.

    A push f is attainable when :math:`lower \le slope\, f \le upper` for every pair of planes.

    Attributes:
        normals: Facet normals, (k, 6); the largest of their products with the rotors' wrenches is 1.
        direction: Force of the rotors per newton of push, n + friction along the travel, in B, (3,).
        slope: Of each pair along the push [-], (k,).
        lower, upper: Distances of both planes from the wrench without push [N], (k,) each.
    """

    normals: ca.DM
    direction: ca.SX
    slope: ca.SX
    lower: ca.SX
    upper: ca.SX


def push_planes(
    signals: Signals,
    vehicle: VehicleParams,
    normal: ca.SX,
    travel: ca.SX,
    friction: ca.SX,
    static_wrench: ca.SX,
) -> PushPlanes:
    r"""Planes that bound the push within the limits in force, against friction along the commanded travel.

    The ray :math:`w(f) = f [d; p \times d] - h`, :math:`d = n + \mu t`, meets the facets of the attainable wrench set
    (`allocation.wrench_facets`), exactly for any number of rotors.

    Args:
        signals: Registry of the thrust limits.
        vehicle: Rotors and tip.
        normal: Into the wall, in B, (3,).
        travel: Commanded velocity along the wall, in B [m/s], (3,).
        friction: Coulomb coefficient [-].
        static_wrench: Wrench on the vehicle without rotors and push [N, N m], (6,).
    """
    facets, count = WrenchFacets(vehicle.geometry), vehicle.geometry.count
    low, high = signals.input("thrust_low", count), signals.input("thrust_high", count)
    speed = ca.norm_2(travel)
    signals.output("reach_friction", ca.if_else(speed > STANDING_SPEED, friction, 0.0))
    direction = normal + ca.if_else(speed > STANDING_SPEED, friction / ca.fmax(speed, STANDING_SPEED), 0.0) * travel
    lever = ca.cross(ca.DM(vehicle.tip_position_m), direction)
    ray = signals.output("reach_direction", ca.vertcat(direction, lever))
    rising, falling = ca.DM(np.maximum(facets.coefficients, 0.0)), ca.DM(np.minimum(facets.coefficients, 0.0))
    offset = -(ca.DM(facets.normals) @ signals.output("static_wrench", static_wrench))
    return PushPlanes(
        normals=ca.DM(facets.normals),
        direction=direction,
        slope=ca.DM(facets.normals) @ ray,
        lower=rising @ low + falling @ high - offset,
        upper=rising @ high + falling @ low - offset,
    )


def push_range(planes: PushPlanes) -> tuple[ca.SX, ca.SX]:
    """Least and largest push between the planes [N]; the least is `NO_PUSH` without one."""
    slope, lower, upper = planes.slope, planes.lower, planes.upper
    along, safe = ca.fabs(slope) > RELATIVE_ZERO, ca.if_else(ca.fabs(slope) > RELATIVE_ZERO, slope, 1.0)
    room = ca.if_else(along, ca.if_else(slope > 0.0, upper, lower) / safe, UNBOUNDED)
    outside = ca.logic_or(lower > ON_PLANE, upper < -ON_PLANE)  # of a pair of planes that the push does not move in
    entry = ca.if_else(along, ca.if_else(slope > 0.0, lower, upper) / safe, ca.if_else(outside, NO_PUSH, 0.0))
    leave, enter = ca.mmin(room), ca.fmax(ca.mmax(entry), 0.0)
    reach = ca.fmax(leave, 0.0)
    return ca.if_else(leave >= enter - ON_PLANE, ca.fmin(enter, reach), NO_PUSH), reach


def push_reach(signals: Signals, planes: PushPlanes) -> ca.SX:
    """Largest push that the limits in force can hold at this attitude [N].

    The reach is the first f at which the ray leaves the attainable set. The output `least_push` is the last f at which
    it enters: above zero where only pushing relieves a weak rotor, and `NO_PUSH` where the vehicle can hold no push,
    not even zero. `ibvs_qp.model.setpoints.Setpoints.limiting_rotors` names the rotors at the reach from the outputs
    `reach_direction` and `static_wrench`.
    """
    least, reach = push_range(planes)
    signals.output("least_push", least)
    return signals.output("reach", reach)


def push_reference(
    signals: Signals, config: ControllerConfig, body: Body, contact: Contact, target: Target, reach: ca.SX
) -> ca.SX:
    """Push reference [N]: at most 97 % of the reach, slewed in contact; 0 without a press command."""
    allowed = ca.fmin(target.push, REACH_FRACTION * reach) if config.reach_check else target.push
    last = signals.state("push_allowed")
    limited = clamp(allowed, last - FALL * body.dt, last + RISE * body.dt)
    allowed = signals.remember("push_allowed", ca.if_else(contact.touching, limited, allowed))
    return signals.output("push_reference", ca.if_else(target.press, allowed, 0.0))


def thrust_window(last: Any, lower: Any, upper: Any, step: Any, floor: Any, ceiling: Any) -> tuple[Any, Any]:
    """Bounds of the thrusts: a limit lowered in flight is approached at the rate limit.

    Args:
        last: Last thrusts [N], (n,); arrays or symbols, like all that follow.
        lower: Lower limits now in force [N], (n,).
        upper: Upper limits now in force [N], (n,).
        step: Largest change in one step [N].
        floor: Lower limits of the vehicle [N], (n,).
        ceiling: Upper limits of the vehicle [N], (n,).

    Returns:
        Lower and upper bounds [N], (n,) each, at least `LEAST_GAP` apart.
    """
    least, most = (np.minimum, np.maximum) if isinstance(last, np.ndarray) else (ca.fmin, ca.fmax)
    reach_low, reach_high = last - step, last + step
    low = least(most(lower, reach_low), reach_high - LEAST_GAP)
    high = most(least(upper, most(reach_high, low + LEAST_GAP)), most(reach_low, low) + LEAST_GAP)
    low = least(most(low, floor), ceiling - LEAST_GAP)
    return low, least(most(high, low + LEAST_GAP), ceiling)
