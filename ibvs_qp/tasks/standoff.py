"""Distance to the wall in free air: a speed-limited motion to the stand-off, or until the tip touches."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from ibvs_qp.model.model import Model
from ibvs_qp.model.rows import TaskRow
from ibvs_qp.symbolic.logic import clamp
from ibvs_qp.tasks.task import Task

#: Peak force of a touch while the stiffness is unknown [N]: v = F / sqrt(k m).
TOUCH_FORCE_BUDGET = 2.9
#: Deceleration of the approach per distance to the touch speed's zone [1/s].
SLOWING = 1.5
#: Integral gain of the approach speed at the wall [1/s^2] and bound of its force [N].
SEARCH_GAIN, SEARCH_BOUND = 6.0, 6.0
#: With a rotor lost: weight over that of a level vehicle [-]: far below the moments, above effort and smoothness.
LOST_WEIGHT = 0.1
#: Likewise: speed away from the wall [m/s], speed error to acceleration [1/s], and its bound [m/s^2].
LOST_SPEED, LOST_GAIN, LOST_BOUND = 0.4, 3.0, 3.0
#: Stand-off target while the tip shall touch [m]: behind the surface, so that the approach never stalls.
TOUCH_TARGET = -0.03


@dataclass(frozen=True, kw_only=True)
class Approach:
    """Motion along n in free air.

    Attributes:
        allowed: Speed limit towards the wall at this distance [m/s].
        speed_error: Target minus predicted closing speed [m/s].
        search: Force against a wall that the force sensor does not measure yet [N].
    """

    allowed: ca.SX
    speed_error: ca.SX
    search: ca.SX


class StandoffTask(Task):
    r"""Net force along n equals mass times the target approach acceleration [N], weight 1 - lambda.

    .. math:: F = m K_d (v - (-\dot e_s)) + F_{search}, \quad v = \min(K_p (e_s - e_{ref}), v_{max}(e_s))

    `Model.filtered` follows with the filter of the push row, except with a rotor lost: the damping amplifies noise. The
    output "standoff_command" is the unfiltered force: the analytic law adds the demand of its lines along n, and a
    filter would feed that part back.
    """

    weight_settings = ("weights.push",)

    def rows(self, model: Model) -> list[TaskRow]:
        """One row in newtons, so that the blend with the push row is linear in lambda."""
        tilted, force, lost = model.attitude.tilted, self.force(model), _lost_force(model)
        model.output("standoff_command", ca.if_else(tilted, lost, force))
        filtered = model.filtered(force, model.force_along_normal, model.gains.push_filter_s)
        level = ca.if_else(tilted, LOST_WEIGHT, 1.0)  # an unreachable force shall not cost moments
        return [
            TaskRow(
                name="standoff",
                unit="N",
                expression=model.force_along_normal,
                target=ca.if_else(tilted, lost, filtered),
                weight=model.weights.push * (1.0 - model.contact_weight) * level,
            )
        ]

    def force(self, model: Model) -> ca.SX:
        """The approach law, without its filter [N]."""
        gains, settings, motion = model.gains, model.config.contact, approach(model)
        landing = ca.logic_and(model.target.press, model.contact.distance < settings.touch_distance_m)
        damping = model.config.vehicle.mass_kg * ca.if_else(landing, settings.landing_kd, gains.standoff_kd)
        return ca.if_else(model.contact.known, damping * motion.speed_error + motion.search, 0.0)


def _lost_force(model: Model) -> ca.SX:
    """Force along n of a vehicle that lost a rotor and turns: its centre of mass keeps the distance [N]."""
    tip, contact, target = ca.DM(model.config.vehicle.tip_position_m), model.contact, model.target
    excess = contact.distance + ca.dot(contact.normal, tip) - ca.norm_2(tip) - target.standoff
    speed = clamp(model.gains.standoff_kp * excess, -LOST_SPEED, LOST_SPEED)
    error = speed - ca.dot(contact.normal, model.body.velocity)
    acceleration = clamp(LOST_GAIN * error, -LOST_BOUND, LOST_BOUND)
    return ca.if_else(contact.known, model.config.vehicle.mass_kg * acceleration, 0.0)


def approach(model: Model) -> Approach:
    """Speeds and search force of the approach, shared with the approach-speed limit."""
    return model.once(("approach",), lambda: _approach(model))


def _approach(model: Model) -> Approach:
    gains, contact = model.gains, model.contact
    error = contact.distance - ca.if_else(model.target.press, TOUCH_TARGET, model.target.standoff)
    allowed = approach_speed(model)
    settings = model.config.contact
    retreat = ca.fmax(settings.retreat_speed_m_s, model.target.standoff / settings.retreat_time_s)
    speed = ca.fmin(ca.fmax(gains.standoff_kp * error, -retreat), allowed)
    speed_error = speed + _predicted_rate(model)
    search = model.output("search_force", _search(model, speed_error))
    return Approach(allowed=model.output("approach_speed", allowed), speed_error=speed_error, search=search)


def approach_speed(model: Model) -> ca.SX:
    r"""Speed limit towards the wall [m/s]: the peak force of a touch is :math:`v \sqrt{k m}`."""
    settings, contact, mass = model.config.contact, model.contact, model.config.vehicle.mass_kg
    far = ca.fmin(
        settings.approach_speed_m_s, settings.close_speed_m_s + (contact.distance - settings.close_distance_m)
    )
    allowed = TOUCH_FORCE_BUDGET / ca.sqrt(contact.stiffness * mass)
    slow = ca.if_else(contact.stiffness_known, settings.close_speed_m_s, settings.touch_speed_m_s)
    last = ca.fmin(slow, allowed) + SLOWING * ca.fmax(contact.distance - settings.touch_distance_m, 0.0)
    near = ca.fmin(last, settings.close_speed_m_s)
    return ca.if_else(contact.distance > settings.close_distance_m, far, near)


def _search(model: Model, speed_error: ca.SX) -> ca.SX:
    """Integral of the speed error near the wall [N]: a noisy force sensor needs a firmer touch."""
    contact, gain = model.contact, model.config.vehicle.mass_kg * SEARCH_GAIN
    old = model.signals.state("search_force")
    step = ca.if_else(model.integrate, model.body.dt, 0.0)
    moved = clamp(old + gain * speed_error * step, 0.0, SEARCH_BOUND)
    near = ca.logic_and(model.target.press, contact.distance < model.config.contact.contact_distance_m)
    new = ca.if_else(near, ca.if_else(contact.touching, old, moved), 0.0)
    return model.signals.remember("search_force", ca.if_else(contact.known, new, old))


def _predicted_rate(model: Model) -> ca.SX:
    r"""Rate of the distance after the lead, :math:`\dot e_s + T \ddot e_s` [m/s].

    A touch on a stiff wall lasts 80 ms. Damping that comes one motor lag late arrives when the tip already leaves.
    """
    return model.contact.rate + model.gains.push_lead_s * model.contact.acceleration
