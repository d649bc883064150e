"""Coulomb friction from tangential against normal force while sliding."""

from __future__ import annotations

import casadi as ca

from ibvs_qp.model.inputs import Body, Contact, clamp
from ibvs_qp.model.signals import Signals

#: Friction assumed while nothing is known (the plant's nominal brush) and plausible range.
ASSUMED_FRICTION, FRICTION_RANGE = 0.3, (0.02, 1.2)
#: Averaging time [s].
AVERAGING_TIME = 0.5
#: Push and sliding speed above which the ratio is meaningful [N], [m/s].
LEAST_PUSH, LEAST_SPEED = 1.5, 0.02
#: A tip that does not follow the commanded travel for this long is held by more friction than believed [s],
#: and the belief rises at this rate until it breaks away [1/s].
PATIENCE, RISE = 0.4, 0.3


#: Friction against which a slide is planned until sliding has shown it: the most a brush has, and so long a slide [s].
CAUTIOUS_FRICTION, SHOWN_AFTER = 0.8, 0.5


def cautious_friction(signals: Signals, friction: ca.SX) -> ca.SX:
    """Friction for the reach: the most that is plausible until a slide has shown what it is."""
    shown = signals.next_state("friction_slid") >= SHOWN_AFTER
    return ca.if_else(shown, friction, ca.fmax(friction, CAUTIOUS_FRICTION))


def estimated_friction(
    signals: Signals,
    body: Body,
    contact: Contact,
    tip: ca.SX,
    travel: ca.SX,
    sliding_command: float,
    stuck_speed: float,
) -> tuple[ca.SX, ca.SX]:
    r"""Friction coefficient believed before and after this tick.

    While sliding :math:`\mu` follows :math:`-F_t / f`; while the tip is held although it shall travel it rises.

    Args:
        signals: Keeps the estimate.
        body: Velocity and measured force.
        contact: Push and whether the tip touches.
        tip: Velocity of the tip, in B [m/s], (3,): a vehicle that turns about a held tip moves, its tip does not.
        travel: Commanded velocity in the wall plane, in B [m/s], (3,).
        sliding_command: Commanded speed above which the tip is meant to slide [m/s].
        stuck_speed: Speed below which it counts as held [m/s].
    """
    before, held = signals.state("friction", start=ASSUMED_FRICTION), signals.state("friction_held")
    speed = ca.norm_2(travel)
    direction = travel / ca.fmax(speed, 1e-9)
    # Both must move: a vehicle that turns about a held tip moves, and its tip's velocity is the noisier one.
    along = ca.fmin(ca.dot(direction, body.velocity), ca.dot(direction, tip))
    watching = ca.logic_and(ca.logic_and(contact.touching, body.velocity_known), speed > 0.0)
    still = ca.logic_and(speed > sliding_command, along < stuck_speed)
    waited = ca.if_else(still, held + body.dt, 0.0)
    signals.remember("friction_held", ca.if_else(watching, waited, held))
    raised = ca.fmin(before + RISE * body.dt, FRICTION_RANGE[1])
    value = ca.if_else(ca.logic_and(watching, waited > PATIENCE), raised, before)
    ratio = clamp(-ca.dot(direction, body.wrench[:3]) / ca.fmax(contact.push, LEAST_PUSH), *FRICTION_RANGE)
    sound = ca.logic_and(ca.logic_and(watching, contact.push >= LEAST_PUSH), along >= LEAST_SPEED)
    slid = signals.state("friction_slid")
    signals.remember("friction_slid", slid + ca.if_else(sound, body.dt, 0.0))
    value = value + ca.if_else(sound, ca.fmin(1.0, body.dt / AVERAGING_TIME), 0.0) * (ratio - value)
    return before, signals.remember("friction", value)
