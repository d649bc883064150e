"""Geometry of a step: roll, pitch and yaw against the wall, wall and tip in the picture."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np

from ibvs_qp.config import VehicleParams
from ibvs_qp.estimation.attitude import filtered_roll_pitch
from ibvs_qp.estimation.inputs import Body, Contact
from ibvs_qp.frames import R_BODY_CAMERA, to_camera
from ibvs_qp.model.inputs import Target
from ibvs_qp.symbolic.logic import clamp
from ibvs_qp.symbolic.signals import Signals

#: Least depth of the wall in front of the camera [m]; it keeps divisions finite.
LEAST_DEPTH = 0.05


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
        target: Commanded roll and pitch.
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


@dataclass(frozen=True, kw_only=True)
class CameraView:
    """Common to all lines of a step, in C.

    Attributes:
        plane: Wall plane (A, B, C) for D = -1.
        depth: Depth of the tip's wall point [m]: where the tip meets the wall when it moves along n.
        tip: Image (x_t, y_t) of that point, normalised.
        tip_place: Image of that point for a level vehicle square to the wall, times depth [m], to the right and down.
        twist: Camera twist [v; omega] without motion along the normal, (6,).
        relative_twist: The same minus the commanded travel: zero where the vehicle moves as commanded.
    """

    plane: ca.SX
    depth: ca.SX
    tip: tuple[ca.SX, ca.SX]
    tip_place: tuple[float, float]
    twist: ca.SX
    relative_twist: ca.SX


def camera_view(vehicle: VehicleParams, body: Body, contact: Contact, travel: ca.SX) -> CameraView:
    """Wall, tip and motion in the camera frame; ``travel`` is the commanded velocity in the wall plane, in B [m/s]."""
    to_c = ca.DM(R_BODY_CAMERA.T)
    tip = to_camera(np.array(vehicle.tip_position_m), np.array(vehicle.camera_position_m))
    normal = to_c @ contact.normal
    depth = ca.fmax(contact.distance + ca.dot(normal, ca.DM(tip)), LEAST_DEPTH)
    foot = ca.DM(tip) + contact.distance * normal
    foot_depth = ca.fmax(foot[2], LEAST_DEPTH)
    in_plane = body.velocity - contact.normal * ca.dot(contact.normal, body.velocity)
    velocity = to_c @ (in_plane + ca.cross(body.rate, ca.DM(vehicle.camera_position_m)))
    rate = to_c @ body.rate
    return CameraView(
        plane=ca.if_else(contact.known, normal / depth, ca.DM([0.0, 0.0, 1.0])),
        depth=foot_depth,
        tip=(foot[0] / foot_depth, foot[1] / foot_depth),
        tip_place=(float(tip[0]), float(tip[1])),
        twist=ca.vertcat(velocity, rate),
        relative_twist=ca.vertcat(velocity - to_c @ travel, rate),
    )
