"""Coulomb friction from tangential against normal force while sliding."""

from __future__ import annotations

import casadi as ca

from ibvs_qp.config import ContactSettings
from ibvs_qp.estimation.inputs import Body, Contact
from ibvs_qp.symbolic.logic import clamp
from ibvs_qp.symbolic.signals import Signals

#: Friction assumed while nothing is known (the plant's nominal brush) and plausible range.
ASSUMED_FRICTION, FRICTION_RANGE = 0.3, (0.02, 1.2)
#: Averaging time [s].
AVERAGING_TIME = 0.5
#: Push above which the ratio is meaningful [N]; sliding speed likewise [m/s], or this part of a slower command.
LEAST_PUSH, LEAST_SPEED, SLOW_RATIO = 1.5, 0.02, 0.5

#: A slide of this length has measured the friction [s]: 0.08 m at the acceleration of a stroke; the weight of the
#: first value is then 14 %, so that a reach at friction 0.8 is 5 % too large at most.
MEASURED_AFTER = 1.0


def cautious_friction(signals: Signals, friction: ca.SX, assumed: float) -> ca.SX:
    """Friction for the reach: at least the assumed one until a slide has measured it."""
    measured = signals.output("friction_measured", signals.next_state("friction_slid") >= MEASURED_AFTER)
    return ca.if_else(measured, friction, ca.fmax(friction, assumed))


def estimated_friction(
    signals: Signals,
    settings: ContactSettings,
    body: Body,
    contact: Contact,
    tip: ca.SX,
    travel: ca.SX,
    sliding_command: float,
) -> tuple[ca.SX, ca.SX]:
    r"""Friction coefficient before and after this tick.

    While sliding :math:`\mu` follows :math:`-F_t / f`; while the tip is stuck against a commanded travel it rises. Tip
    velocity and travel are in B [m/s], (3,): a vehicle that turns about a stuck tip moves, its tip does not.
    ``sliding_command`` is the commanded speed above which the tip shall slide [m/s].
    """
    stuck_speed = settings.stuck_speed_m_s
    before, stuck = signals.state("friction", start=ASSUMED_FRICTION), signals.state("friction_stuck")
    speed = ca.norm_2(travel)
    direction = travel / ca.fmax(speed, 1e-9)
    # Both must move: a vehicle that turns about a stuck tip moves, and its tip's velocity is the noisier one.
    along = ca.fmin(ca.dot(direction, body.velocity), ca.dot(direction, tip))
    watching = ca.logic_and(ca.logic_and(contact.touching, body.velocity_known), speed > 0.0)
    still = ca.logic_and(speed > sliding_command, along < stuck_speed)
    # A noisy sample of the velocity does not begin the wait anew, a commanded stop does.
    patience = settings.friction_patience_s
    waited = ca.if_else(still, ca.fmin(stuck + body.dt, 2.0 * patience), ca.fmax(stuck - 2.0 * body.dt, 0.0))
    slide = ca.if_else(watching, waited, stuck)
    signals.remember("friction_stuck", ca.if_else(speed > sliding_command, slide, 0.0))
    raised = ca.fmin(before + settings.friction_rise_1_s * body.dt, FRICTION_RANGE[1])
    sticks = ca.logic_and(watching, ca.logic_and(still, waited > patience))
    value = ca.if_else(sticks, raised, before)
    least = ca.fmin(LEAST_SPEED, ca.fmax(SLOW_RATIO * speed, stuck_speed))
    ratio = clamp(-ca.dot(direction, body.wrench[:3]) / ca.fmax(contact.push, LEAST_PUSH), *FRICTION_RANGE)
    slides = ca.logic_and(speed > sliding_command, along >= least)
    sound = ca.logic_and(ca.logic_and(watching, contact.push >= LEAST_PUSH), slides)
    slid = signals.state("friction_slid")
    signals.remember("friction_slid", slid + ca.if_else(sound, body.dt, 0.0))
    value = value + ca.if_else(sound, ca.fmin(1.0, body.dt / AVERAGING_TIME), 0.0) * (ratio - value)
    return before, signals.remember("friction", value)
