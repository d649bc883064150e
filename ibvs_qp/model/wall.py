"""Wall axes in B, and the turn that levels the vehicle and faces the wall."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from ibvs_qp.config import ControllerConfig
from ibvs_qp.model.feedforward import SLIDING_COMMAND, moment_lag
from ibvs_qp.model.inputs import SLOT_INPUTS, Body, Touch, Wish, clamp
from ibvs_qp.model.signals import Signals

#: Yaw acceleration asked for at most by a vehicle that has lost a rotor [rad/s^2].
LOST_TURN = 2.0
#: Share of the stiffest stable yaw that is used while friction holds the tip.
HELD_SHARE = 1.0 / 3.0


@dataclass(frozen=True, kw_only=True)
class Wall:
    """Unit vectors in B: normal into the wall, right and down in its plane."""

    normal: ca.SX
    right: ca.SX
    down: ca.SX


def wall_axes(signals: Signals, body: Body, touch: Touch) -> Wall:
    """Right is level and in the wall, down completes it."""
    across = ca.cross(body.down, touch.normal)
    right = signals.output("axis_right", across / ca.fmax(ca.norm_2(across), 1e-6))
    down = signals.output("axis_down", ca.cross(touch.normal, right))
    return Wall(normal=signals.output("normal", touch.normal), right=right, down=down)


def held_gains(config: ControllerConfig) -> tuple[float, float]:
    r"""Stiffest pitch and yaw of a vehicle whose tip is held by friction while no line fixes its place [1/s^2].

    It turns about the tip, L ahead. The fed-forward contact moment comes T late, and what is late of it is the moment
    of the vehicle's own mass: :math:`J\ddot\psi = J\alpha + T \, d/dt (m L^2 \ddot\psi + L F)`. With
    :math:`\alpha = -K_p \psi - K_d \dot\psi` and :math:`F = -m K_v v`, :math:`v = -L \dot\psi`, Routh asks for

    .. math:: K_p < K_d \Big(\frac{J}{m L^2 T} + K_v\Big),

    26 in pitch and 31 in yaw for the shipped vehicle. A third of it is taken. Stiffer, the vehicle rocks about its tip
    until it slips.
    """
    vehicle, gains = config.vehicle, config.gains
    swing = max(vehicle.mass_kg * vehicle.tip_position_m[0] ** 2 * moment_lag(config), 1e-9)
    _, pitch, yaw = vehicle.inertia_kg_m2
    return (
        HELD_SHARE * gains.attitude_kd * (pitch / swing + gains.velocity_kp),
        HELD_SHARE * gains.yaw_kd * (yaw / swing + gains.velocity_kp),
    )


def _stiffness(signals: Signals, config: ControllerConfig, still: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Stiffness of pitch and yaw: the configured ones, softer while friction alone holds the tip up or sideways."""
    gains = config.gains
    pitch, yaw = ca.SX(gains.attitude_kp), ca.SX(gains.yaw_kp)
    if not config.contact_feedforward:
        return pitch, yaw
    vertical, level, upright = signals.input("vertical", config.line_slots), ca.SX(0.0), ca.SX(0.0)
    for slot in range(config.line_slots):
        present, *_, weight, _ = ca.vertsplit(signals.input(f"line_{slot}", SLOT_INPUTS))
        level = ca.fmax(level, (1.0 - vertical[slot]) * present * weight)
        upright = ca.fmax(upright, vertical[slot] * present * weight)
    soft_pitch, soft_yaw = held_gains(config)
    pitch = pitch + still * (1.0 - level) * (min(gains.attitude_kp, soft_pitch) - gains.attitude_kp)
    yaw = yaw + still * (1.0 - upright) * (min(gains.yaw_kp, soft_yaw) - gains.yaw_kp)
    return pitch, yaw


def wanted_turn(signals: Signals, config: ControllerConfig, body: Body, touch: Touch, wish: Wish) -> None:
    r"""Angles and wanted accelerations :math:`-K_p \varphi - K_d \dot\varphi` of roll, pitch and yaw [rad/s^2]."""
    gains = config.gains
    still = ca.logic_and(touch.touching, ca.norm_2(wish.velocity) <= SLIDING_COMMAND)
    still = signals.output("held", ca.SX(still))
    roll = ca.atan2(body.down[1], body.down[2])
    pitch = ca.asin(clamp(-body.down[0], -1.0, 1.0))
    yaw = ca.if_else(touch.known, -ca.atan2(touch.normal[1], touch.normal[0]), 0.0)
    pitch_kp, yaw_kp = _stiffness(signals, config, still)
    stiffness = (gains.attitude_kp, pitch_kp, yaw_kp)
    damping = (gains.attitude_kd, gains.attitude_kd, gains.yaw_kd)
    tilt = signals.output("tilt_error", ca.vertcat(roll, pitch) - wish.tilt)
    lost = signals.output("tilted", ca.norm_2(wish.tilt) > 0.0)
    # A tilted vehicle that turns about the vertical has roll and pitch rates without changing either angle.
    p, q, r = ca.vertsplit(body.rate)
    swept = ca.vertcat(p + ca.tan(pitch) * (q * ca.sin(roll) + r * ca.cos(roll)), q * ca.cos(roll) - r * ca.sin(roll))
    rates = signals.output("tilt_rate", ca.if_else(lost, swept, body.rate[:2]))
    wanted = [
        -kp * angle - kd * rate
        for angle, rate, kp, kd in zip(
            (tilt[0], tilt[1], yaw), (rates[0], rates[1], body.rate[2]), stiffness, damping, strict=True
        )
    ]
    signals.output("angles", ca.vertcat(roll, pitch, yaw))
    # Tilted for a lost rotor nothing holds yaw: asked for as ever it would cost roll and pitch.
    wanted[2] = ca.if_else(lost, clamp(-gains.yaw_kd * body.rate[2], -LOST_TURN, LOST_TURN), wanted[2])
    signals.output("angular", ca.vertcat(*wanted))
