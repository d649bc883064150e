"""Axes of the wall in the body frame; roll and pitch errors, yaw away from the wall normal, and their rates."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from ibvs_qp.estimation.roll_pitch import filtered_roll_pitch
from ibvs_qp.model.inputs import Body, Contact, Target, clamp
from ibvs_qp.symbolic.signals import Signals

#: Least sine between wall normal and gravity; it keeps the axes of a floor finite.
LEAST_CROSS = 1e-6


@dataclass(frozen=True, kw_only=True)
class WallAxes:
    """Unit vectors in B: normal into the wall, right and down in its plane."""

    normal: ca.SX
    right: ca.SX
    down: ca.SX

    def in_body(self, right: ca.SX, down: ca.SX) -> ca.SX:
        """A vector of the wall plane in B, (3,)."""
        return right * self.right + down * self.down


def wall_axes(body: Body, contact: Contact) -> WallAxes:
    """Axes of the wall: right is level and in the wall, down completes it."""
    across = ca.cross(body.down, contact.normal)
    right = across / ca.fmax(ca.norm_2(across), LEAST_CROSS)
    return WallAxes(normal=contact.normal, right=right, down=ca.cross(contact.normal, right))


@dataclass(frozen=True, kw_only=True)
class Attitude:
    """Attitude relative to gravity, wall and target.

    Attributes:
        roll, pitch: Tait-Bryan angles z-y-x [rad].
        yaw: Of the body axis away from the wall normal [rad], 0 while no wall is known.
        tilt_error: Roll and pitch minus their targets [rad], (2,).
        tilt_rate: Rates of roll and pitch [rad/s], (2,); tilt_rate_ahead: those after the lead.
        tilted: 1 for a vehicle that lost a rotor: it flies tilted, and cannot hold yaw.
        trimmed: 1 for a vehicle with a rotor that is stuck: it moves along the wall by tilting.
    """

    roll: ca.SX
    pitch: ca.SX
    yaw: ca.SX
    tilt_error: ca.SX
    tilt_rate: ca.SX
    tilt_rate_ahead: ca.SX
    tilted: ca.SX
    trimmed: ca.SX


def attitude(
    signals: Signals,
    body: Body,
    contact: Contact,
    target: Target,
    rate_ahead: ca.SX,
    bandwidth_hz: float,
    trim_tilt: ca.SX,
) -> Attitude:
    """Angles and rates of a step.

    Args:
        signals: Registry of the filter of roll and pitch.
        body: Attitude and angular velocity.
        contact: Normal of the wall.
        target: Roll and pitch to fly.
        rate_ahead: Angular velocity after the lead [rad/s], (3,).
        bandwidth_hz: Of the attitude estimate in roll and pitch [Hz] (`filtered_roll_pitch`).
        trim_tilt: Roll and pitch taken by a push above 85 % of the level reach [rad], (2,) (`ibvs_qp.model.trim_tilt`).
    """
    roll = ca.atan2(body.down[1], body.down[2])
    pitch = ca.asin(clamp(-body.down[0], -1.0, 1.0))
    yaw = ca.if_else(contact.known, -ca.atan2(contact.normal[1], contact.normal[0]), 0.0)
    tilt, trim = ca.vertcat(target.roll, target.pitch), ca.vertcat(target.trim_roll, target.trim_pitch)
    tilted, target_angles = ca.norm_2(tilt) > 0.0, tilt + trim + trim_tilt

    # Near level the body rates are the angle rates; a tilted vehicle that turns about the vertical has body rates
    # in roll and pitch without changing either angle.
    def swept(rate: ca.SX) -> ca.SX:
        p, q, r = ca.vertsplit(rate)
        angles = p + ca.tan(pitch) * (q * ca.sin(roll) + r * ca.cos(roll)), q * ca.cos(roll) - r * ca.sin(roll)
        return ca.if_else(tilted, ca.vertcat(*angles), rate[:2])

    rates = swept(body.rate)
    filtered = filtered_roll_pitch(signals, ca.vertcat(roll, pitch), rates, bandwidth_hz, body.dt)
    return Attitude(
        roll=roll,
        pitch=pitch,
        yaw=yaw,
        tilt_error=filtered - target_angles,
        tilt_rate=rates,
        tilt_rate_ahead=swept(rate_ahead),
        tilted=tilted,
        trimmed=ca.norm_2(trim) > 0.0,
    )
