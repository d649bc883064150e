"""Forces along the wall normal: the impedance force law, and the speed-limited approach."""

from __future__ import annotations

import casadi as ca

from ibvs_qp.analysis.contact_loop import FULL_GAIN_STIFFNESS
from ibvs_qp.config import ContactSettings, ControllerConfig
from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.model.inputs import Body, Touch, Wish, clamp
from ibvs_qp.model.reach import REACH_SHARE
from ibvs_qp.model.signals import Signals

#: Bound of the force integral as a force [N].
FORCE_INTEGRAL_BOUND = 8.0
#: Peak force that a touch may reach while the stiffness is unknown [N]: v = F / sqrt(k m).
TOUCH_FORCE_BUDGET = 2.9
#: How fast the approach slows down to the speed of the touch [1/s].
SLOWING = 1.5
#: Fastest fall and rise of the push in contact, when reach or wish change [N/s]: a limit that is lost is followed.
FALL, RISE = 60.0, 10.0
#: Integral gain of the approach speed at the wall [1/s^2] and bound of its force [N].
SEARCH_GAIN, SEARCH_BOUND = 6.0, 6.0
#: Lowest stand-off aimed at while the tip shall touch [m]: behind the surface, so that the approach never stalls.
TOUCH_TARGET = -0.03
#: Force or moment given up above which no integral moves [N, N m].
WINDUP_FORCE = 0.5


def push_force(signals: Signals, config: ControllerConfig, body: Body, touch: Touch, wish: Wish, reach: ca.SX) -> ca.SX:
    r"""Wanted force along n in contact [N] (paper, with the sign of the force feedback corrected).

    .. math:: F = F_{ref} + K_{sp} e_s + K_{sd} \dot e_s + K_{fp} (F_{ref} - f) + K_{fi} \int (F_{ref} - f)

    F_ref rises with the ramp and stays within reach; the integral is zero before touch, frozen while rotors are
    limited, moves by what lambda lets through, and the proportional gain falls with the measured stiffness.
    """
    gains = config.gains
    allowed = ca.fmin(wish.push, REACH_SHARE * reach) if config.reach_check else wish.push
    last, step = signals.state("push_allowed"), ca.vertcat(FALL, RISE) * body.dt
    allowed = ca.if_else(touch.touching, clamp(allowed, last - step[0], last + step[1]), allowed)
    signals.remember("push_allowed", allowed)
    reference = signals.output("push_reference", ca.if_else(wish.press, allowed, 0.0))
    ceiling = config.limits.push_share * reference
    signals.output("push_state", ca.vertcat(ceiling, touch.stiffness, touch.rate, touch.touching * wish.press))
    wanted = reference * touch.ramp
    old, bound = signals.state("force_integral"), FORCE_INTEGRAL_BOUND / max(gains.force_kfi, 1e-6)
    free = signals.input("given_up") < WINDUP_FORCE
    step = ca.if_else(free, body.dt, 0.0) * signals.input("contact_weight")
    moved = clamp(old + step * (wanted - touch.push), -bound, bound)
    integral = signals.remember("force_integral", ca.if_else(ca.logic_and(touch.touching, wish.press), moved, 0.0))
    softness = ca.fmin(1.0, FULL_GAIN_STIFFNESS / touch.stiffness)
    force = wanted + softness * gains.force_kfp * (wanted - touch.push) + gains.force_kfi * integral
    if config.impedance:
        impedance = gains.force_ksp * touch.distance + gains.force_ksd * rate_ahead(config.vehicle, touch)
        force = force + ca.if_else(touch.known, impedance, 0.0)
    return signals.output("push_command", force)


def rate_ahead(vehicle: VehicleParams, touch: Touch) -> ca.SX:
    r"""Rate of the distance as it will be when the motors have answered, :math:`\dot e_s + \tau \ddot e_s` [m/s].

    A touch on a stiff wall lasts 80 ms. Damping that comes one motor lag late arrives when the tip already leaves.
    """
    return touch.rate + 0.5 * (vehicle.motor_lag_up_s + vehicle.motor_lag_down_s) * touch.acceleration


def standoff_force(signals: Signals, config: ControllerConfig, body: Body, touch: Touch, wish: Wish) -> ca.SX:
    """Wanted force along n in free air [N]: a speed-limited motion to the stand-off, or until the tip touches."""
    gains, settings, mass = config.gains, config.contact, config.vehicle.mass_kg
    error = touch.distance - ca.if_else(wish.press, TOUCH_TARGET, wish.standoff)
    allowed = approach_speed(settings, mass, touch)
    free = ca.logic_and(touch.known, ca.logic_not(touch.touching))
    speed = ca.fmin(ca.fmax(gains.standoff_kp * error, -settings.retreat_speed_m_s), allowed)
    lag = speed + rate_ahead(config.vehicle, touch)
    search = _search(signals, config, body, touch, wish, lag)
    steady = ca.logic_and(free, ca.logic_not(signals.outputs["tilted"]))  # a turning tip is no approach
    signals.output("approach_state", ca.vertcat(allowed, touch.rate, search / mass, steady))
    landing = ca.logic_and(wish.press, touch.distance < settings.touch_distance_m)
    force = mass * ca.if_else(landing, settings.landing_kd, gains.standoff_kd) * lag + search
    return signals.output("standoff_command", ca.if_else(touch.known, force, 0.0))


def _search(signals: Signals, config: ControllerConfig, body: Body, touch: Touch, wish: Wish, lag: ca.SX) -> ca.SX:
    """Lean on harder while the tip should move in but does not: a noisy force sensor needs a firmer touch."""
    old, gain = signals.state("search_force"), config.vehicle.mass_kg * SEARCH_GAIN
    step = ca.if_else(signals.input("given_up") < WINDUP_FORCE, body.dt, 0.0)
    moved = clamp(old + gain * lag * step, 0.0, SEARCH_BOUND)
    near = ca.logic_and(wish.press, touch.distance < config.contact.contact_distance_m)
    new = ca.if_else(near, ca.if_else(touch.touching, old, moved), 0.0)
    return signals.remember("search_force", ca.if_else(touch.known, new, old))


def approach_speed(settings: ContactSettings, mass: float, touch: Touch) -> ca.SX:
    r"""Speed limit towards the wall [m/s]: the peak force of a touch is :math:`v \sqrt{k m}`."""
    far = ca.fmin(settings.approach_speed_m_s, settings.close_speed_m_s + (touch.distance - settings.close_distance_m))
    allowed = TOUCH_FORCE_BUDGET / ca.sqrt(touch.stiffness * mass)
    slow = ca.if_else(touch.stiffness_known, settings.close_speed_m_s, settings.touch_speed_m_s)
    last = ca.fmin(slow, allowed) + SLOWING * ca.fmax(touch.distance - settings.touch_distance_m, 0.0)
    near = ca.fmin(last, settings.close_speed_m_s)
    return ca.if_else(touch.distance > settings.close_distance_m, far, near)
