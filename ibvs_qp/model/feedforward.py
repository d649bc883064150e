"""Contact feed-forward: moments, and friction only along the commanded travel (design section 4.3).

Cancelling the whole measured wrench is wrong: a stuck tip returns our own push (an integrator), and friction across
the travel is damping that a delayed cancellation turns negative.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import casadi as ca

from ibvs_qp.config import ContactSettings, ControllerConfig
from ibvs_qp.estimation.inputs import Body, Contact
from ibvs_qp.symbolic.signals import Signals

#: Commanded speed above which the tip is meant to slide [m/s].
SLIDING_COMMAND = 0.01
#: Least step of the friction force [N]; it keeps the slew limit finite.
LEAST_FORCE_STEP = 1e-12
#: Used fraction of the largest stable stiffness; closer to it the vehicle rocks about its tip until it slips.
STIFFNESS_FRACTION = 1.0 / 3.0


@dataclass(frozen=True, kw_only=True)
class ContactFeedforward:
    """The part of the contact wrench that may be compensated.

    Attributes:
        force: Expected once the rotors answer [N], (3,).
        moment: Expected then [N m], (3,).
        felt_moment: The measured moment, which acts now [N m], (3,).
    """

    force: ca.SX
    moment: ca.SX
    felt_moment: ca.SX


def contact_feedforward(
    signals: Signals,
    config: ControllerConfig,
    body: Body,
    contact: Contact,
    travel: ca.SX,
    friction: ca.SX,
) -> ContactFeedforward:
    r"""Wrench that the contact will put on the vehicle.

    Force: :math:`F = -g \mu f t` along the commanded travel t while sliding, slew-limited; nothing across the travel.
    Moment: the measured one, low-passed, its gain falling with the noise of the force sensor; it is late by the
    motors' lag and that filter, T, so the part that the force above is about to add comes from the model,

    .. math:: M = \hat M + \frac{T s}{T s + 1}\, p \times F,

    with p the tip. Without it a sticking tip turns the vehicle by a degree before the moment is measured, and jumps
    when it breaks away.

    ``travel`` is the commanded velocity in the wall plane, in B [m/s], (3,), ``friction`` the coefficient.
    """
    settings = config.contact
    force = signals.remember("feedforward_friction", _friction(signals, settings, body, contact, travel, friction))
    smoothing = 1.0 - ca.exp(-2.0 * ca.pi * settings.force_filter_hz * body.dt)
    gain = contact.touching * settings.moment_gain / (1.0 + (contact.moment_noise / settings.moment_noise_n) ** 2)
    old = signals.state("feedforward_moment", 3)
    felt = signals.remember("feedforward_moment", old + smoothing * (gain * body.wrench[3:] - old))
    model = settings.moment_gain * ca.cross(ca.DM(config.vehicle.tip_position_m), force)
    known = signals.state("feedforward_known", 3)
    late = 1.0 - ca.exp(-body.dt / moment_lag(config))
    known = signals.remember("feedforward_known", known + late * (model - known))
    return ContactFeedforward(force=force, moment=felt + model - known, felt_moment=felt)


def moment_lag(config: ControllerConfig) -> float:
    """Delay from a measured moment to the rotors' response: their mean lag and that of the filter [s]."""
    return config.vehicle.motor_lag_s + 1.0 / (2.0 * math.pi * config.contact.force_filter_hz)


def _friction(
    signals: Signals, settings: ContactSettings, body: Body, contact: Contact, travel: ca.SX, friction: ca.SX
) -> ca.SX:
    speed = ca.norm_2(travel)
    sliding = ca.logic_and(speed > SLIDING_COMMAND, contact.touching)
    size = -settings.friction_gain * friction * ca.fmax(contact.push, 0.0) / ca.fmax(speed, SLIDING_COMMAND)
    last = signals.state("feedforward_friction", 3)
    step = ca.if_else(sliding, size * travel, 0.0) - last
    allowed = ca.if_else(contact.touching, settings.friction_slew_n_s * body.dt, ca.inf)
    return last + step * ca.fmin(1.0, allowed / ca.fmax(ca.norm_2(step), LEAST_FORCE_STEP))


def pivot_stiffness(config: ControllerConfig, gains: Any = None) -> tuple[Any, Any]:
    r"""Stiffness of pitch and yaw while friction holds the tip and no line fixes its place [1/s^2].

    The vehicle turns about the tip, L ahead. The fed-forward contact moment is T late, and the late part of it is the
    moment of the vehicle's own mass: :math:`J\ddot\psi = J\alpha + T \, d/dt (m L^2 \ddot\psi + L F)`. With
    :math:`\alpha = -K_p \psi - K_d \dot\psi` and :math:`F = -m K_v v`, :math:`v = -L \dot\psi`, Routh's criterion is

    .. math:: K_p < K_d \Big(\frac{J}{m L^2 T} + K_v\Big),

    316 in pitch and 228 in yaw for the shipped vehicle and gains of the program.

    Args:
        config: Vehicle and delay of the feed-forward.
        gains: Numbers or symbols; those of the configuration by default.
    """
    vehicle, gains = config.vehicle, gains or config.gains
    swing = max(vehicle.mass_kg * vehicle.tip_position_m[0] ** 2 * moment_lag(config), 1e-9)
    _, pitch, yaw = vehicle.inertia_kg_m2
    return (
        STIFFNESS_FRACTION * gains.attitude_kd * (pitch / swing + gains.velocity_kp),
        STIFFNESS_FRACTION * gains.yaw_kd * (yaw / swing + gains.velocity_kp),
    )
