"""Line errors at the tip: integral, rate and wanted image acceleration of every line slot."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np

from ibvs_qp.config import ControllerConfig
from ibvs_qp.frames import R_BODY_CAMERA, to_camera
from ibvs_qp.model.inputs import SLOT_INPUTS, Body, Touch, clamp
from ibvs_qp.model.signals import Signals
from ibvs_qp.model.wall import Wall

#: Bound of the integral of a line error, as the image acceleration it commands [1/s^2].
INTEGRAL_BOUND = 0.6
#: Rate filter when no velocity is known [s].
RATE_FILTER = 0.08
#: Errors enter the law only up to this size [normalised]; a far line is approached at a steady pace.
ERROR_BOUND = 0.10
#: The wall is never taken to be nearer to the camera than this [m].
LEAST_DEPTH = 0.05
#: Entries of a slot's output "line_k_terms", in this order.
LINE_TERMS = "error error_rate angle_error angle_rate integral weight rho_error rho_rate".split()


@dataclass(frozen=True, kw_only=True)
class View:
    """What all lines of a tick share, in C: wall plane, image of the tip's wall point, camera motion.

    Attributes:
        plane: (A, B, C) for D = -1.
        depth: Depth of the tip's wall point [m]; x, y: its image.
        velocity: Of the camera without the motion along the normal [m/s]; turn [rad/s].
        wanted: Velocity that the reference asks for [m/s].
    """

    plane: ca.SX
    depth: ca.SX
    x: ca.SX
    y: ca.SX
    velocity: ca.SX
    turn: ca.SX
    wanted: ca.SX


def camera_view(
    signals: Signals, config: ControllerConfig, body: Body, touch: Touch, wall: Wall, travel: ca.SX
) -> View:
    """The wall, the tip's wall point and the camera's twist as the camera sees them."""
    vehicle, into = config.vehicle, ca.DM(R_BODY_CAMERA.T)
    tip = ca.DM(to_camera(np.array(vehicle.tip_position_m), np.array(vehicle.camera_position_m)))
    normal = into @ wall.normal
    depth = ca.fmax(touch.distance + ca.dot(normal, tip), LEAST_DEPTH)
    foot = tip + touch.distance * normal
    ahead = ca.fmax(foot[2], LEAST_DEPTH)
    across = body.velocity - wall.normal * ca.dot(wall.normal, body.velocity)
    lever = ca.cross(body.rate, ca.DM(vehicle.camera_position_m))
    plane = ca.if_else(touch.known, normal / depth, ca.DM([0.0, 0.0, 1.0]))
    return View(
        plane=signals.output("plane", plane),
        depth=ahead,
        x=foot[0] / ahead,
        y=foot[1] / ahead,
        velocity=into @ (across + lever),
        turn=into @ body.rate,
        wanted=into @ travel,
    )


@dataclass(frozen=True, kw_only=True)
class SlotLine:
    """What the line of a slot means to the others: 1 if present, its weight, place and own rate."""

    present: ca.SX
    weight: ca.SX
    rho: ca.SX
    theta: ca.SX
    rate: ca.SX


def line_slot(
    signals: Signals, config: ControllerConfig, slot: int, body: Body, view: View, integrate: ca.SX
) -> SlotLine:
    r"""Error of one line at the tip and what is wanted of it.

    .. math:: e = \rho - (x_t\cos\theta + y_t\sin\theta) - (\rho_{ref} - y_0 \sin\theta_{ref}), \qquad
              \ddot e = -(K_p e + K_d \dot e + K_i \textstyle\int e)

    with (x_t, y_t) the image of the point at which the tip meets the wall (endpoint closed loop) and y_0 its
    nominal height. The rate follows from the camera's velocity and the rows of the interaction matrix; without a
    known velocity it is differentiated and filtered.
    """
    gains, weights = config.gains, config.weights
    name = f"line_{slot}"
    present, rho, theta, rho_ref, theta_ref, seen_weight, variance = ca.vertsplit(signals.input(name, SLOT_INPUTS))
    vehicle = config.vehicle
    tip_down = float(to_camera(np.array(vehicle.tip_position_m), np.array(vehicle.camera_position_m))[1])
    c, s = ca.cos(theta), ca.sin(theta)
    error = rho - (view.x * c + view.y * s) - (rho_ref - tip_down / view.depth * ca.sin(theta_ref))
    rate, rho_rate, angle_rate, own_rate = _rates(signals, name, body, view, rho, c, s, error, present)
    bounded, rho_error = clamp(error, -ERROR_BOUND, ERROR_BOUND), clamp(rho - rho_ref, -ERROR_BOUND, ERROR_BOUND)
    integral = signals.state(f"{name}_integral")
    if gains.line_ki > 0.0:
        bound = INTEGRAL_BOUND / gains.line_ki
        moved = clamp(integral + body.dt * bounded * seen_weight, -bound, bound)
        integral = signals.remember(f"{name}_integral", ca.if_else(ca.logic_and(present, integrate), moved, integral))
    weight = present * seen_weight / (1.0 + ca.fmax(variance, 0.0) / weights.line_sigma**2)
    angle_error = theta - theta_ref
    wanted = -(gains.line_kp * bounded + gains.line_kd * rate + gains.line_ki * integral)
    turn = -(gains.theta_kp * angle_error + gains.theta_kd * angle_rate)
    row = (rho, theta, view.x, view.y, wanted, turn, weights.line * weight, weights.line_angle * weight)
    if config.line_profile == "paper":
        wanted = -(gains.line_kp * rho_error + gains.line_kd * rho_rate + gains.line_ki * integral)
        row = (rho, theta, ca.SX(0.0), ca.SX(0.0), wanted, turn, weights.line * weight, ca.SX(0.0))
    signals.output(name, ca.vertcat(*row))
    terms = (bounded, rate, angle_error, angle_rate, integral, weight, rho_error, rho_rate)
    signals.output(f"{name}_terms", ca.vertcat(*terms))
    return SlotLine(present=present, weight=weight, rho=rho, theta=theta, rate=own_rate)


def _rates(
    signals: Signals,
    name: str,
    body: Body,
    view: View,
    rho: ca.SX,
    c: ca.SX,
    s: ca.SX,
    error: ca.SX,
    present: ca.SX,
) -> tuple[ca.SX, ca.SX, ca.SX, ca.SX]:
    """Rates of the error, of rho and of the angle error, the reference's own motion taken off, and rho's own."""
    along = ca.vertcat(c, s, -rho)
    a, b, z = ca.vertsplit(view.plane)
    l_theta, l_rho = b * c - a * s, -(a * rho * c + b * rho * s + z)
    motion, wanted = ca.dot(along, view.velocity), ca.dot(along, view.wanted)
    rho_rate = l_rho * (motion - wanted) + (1.0 + rho**2) * (s * view.turn[0] - c * view.turn[1])
    angle_rate = l_theta * motion - rho * (c * view.turn[0] + s * view.turn[1]) - view.turn[2]
    rate = rho_rate + (view.x * s - view.y * c) * (angle_rate - l_theta * wanted)
    last_error, last_rate, known = ca.vertsplit(signals.state(f"{name}_last", 3))
    step = (error - ca.if_else(known, last_error, error)) / ca.fmax(body.dt, 1e-4)
    filtered = last_rate + ca.fmin(1.0, body.dt / RATE_FILTER) * (step - last_rate)
    rate = ca.if_else(body.moving, rate, filtered)
    kept = ca.if_else(present, ca.vertcat(error, rate, 1.0), ca.vertcat(last_error, last_rate, known))
    signals.remember(f"{name}_last", kept)
    own_rate = ca.if_else(body.moving, rho_rate + l_rho * wanted, filtered)
    return rate, ca.if_else(body.moving, rho_rate, filtered), ca.if_else(body.moving, angle_rate, 0.0), own_rate


def turn_share(signals: Signals, config: ControllerConfig) -> ca.SX:
    r"""Share of the body's turn that line rows count on: :math:`1 - \lambda (1 - r)`, r the gain, where it travels.

    A tip that shall stay is held by friction as the rows in full say. Counting on less, the level line moves the
    vehicle where nothing is to move: with r = 0.3, 35 N asked for beyond reach lose 1.6 N of 30.1 N. A tip that shall
    travel may be held all the same; there the full row subtracts from the wish what the turn never brings.
    """
    less = 1.0 - config.gains.line_turn_share
    return 1.0 - signals.input("contact_weight") * (1.0 - signals.outputs["held"]) * less
