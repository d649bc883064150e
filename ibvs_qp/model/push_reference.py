"""The push reference: the commanded push within the reach of the rotors."""

from __future__ import annotations

import casadi as ca

from ibvs_qp.config import ControllerConfig
from ibvs_qp.model.inputs import Body, Contact, Target, clamp
from ibvs_qp.model.signals import Signals

#: Fraction of the reach that a push may use; the rest holds the vehicle in place.
REACH_FRACTION = 0.97
#: Fastest fall and rise of the reference in contact [N/s]: a fall follows a thrust limit that was just lowered.
FALL, RISE = 60.0, 10.0


def push_reference(
    signals: Signals, config: ControllerConfig, body: Body, contact: Contact, target: Target, reach: ca.SX
) -> ca.SX:
    """Push reference [N]: at most 97 % of the reach, slewed in contact; 0 without a press command."""
    allowed = ca.fmin(target.push, REACH_FRACTION * reach) if config.reach_check else target.push
    last = signals.state("push_allowed")
    limited = clamp(allowed, last - FALL * body.dt, last + RISE * body.dt)
    allowed = signals.remember("push_allowed", ca.if_else(contact.touching, limited, allowed))
    return signals.output("push_reference", ca.if_else(target.press, allowed, 0.0))
