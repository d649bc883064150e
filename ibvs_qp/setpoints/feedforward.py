"""Contact feed-forward: measured moments, and friction only along the commanded travel (design section 4.3).

Cancelling the whole measured wrench is wrong: a stuck tip returns our own push (an integrator), and friction across
the travel is damping that a delayed cancellation turns negative.
"""

from __future__ import annotations

import casadi as ca

from ibvs_qp.config import ContactSettings
from ibvs_qp.setpoints.sensed import Body, Touch
from ibvs_qp.setpoints.signals import Signals

#: Commanded speed above which the tip is meant to slide [m/s].
SLIDING_COMMAND = 0.01


def contact_feedforward(
    signals: Signals, settings: ContactSettings, body: Body, touch: Touch, travel: ca.SX, friction: ca.SX
) -> ca.SX:
    r"""Wrench that the contact will put on the vehicle, as far as it may be compensated [N, N m], (6,).

    Moment: the measured one, low-passed, its share falling with the noise of the force sensor. Force:
    :math:`-g \mu f t` along the commanded travel t while sliding, slew-limited; nothing across the travel.

    Args:
        signals: Keeps the filters' states.
        settings: Gains, filter and slew.
        body: Measured wrench and time step.
        touch: Push and whether the tip touches.
        travel: Commanded velocity in the wall plane, in B [m/s], (3,).
        friction: Estimated Coulomb coefficient.
    """
    share = 1.0 - ca.exp(-2.0 * ca.pi * settings.force_filter_hz * body.dt)
    gain = touch.touching * settings.moment_gain / (1.0 + (touch.across_noise / settings.moment_noise_n) ** 2)
    old = signals.state("feedforward_moment", 3)
    moment = signals.remember("feedforward_moment", old + share * (gain * body.wrench[3:] - old))
    speed = ca.norm_2(travel)
    sliding = ca.logic_and(speed > SLIDING_COMMAND, touch.touching)
    size = -settings.friction_gain * friction * ca.fmax(touch.push, 0.0) / ca.fmax(speed, SLIDING_COMMAND)
    last = signals.state("feedforward_friction", 3)
    step = ca.if_else(sliding, size * travel, 0.0) - last
    allowed = ca.if_else(touch.touching, settings.friction_slew_n_s * body.dt, ca.inf)
    force = last + step * ca.fmin(1.0, allowed / ca.fmax(ca.norm_2(step), 1e-12))
    return ca.vertcat(signals.remember("feedforward_friction", force), moment)
