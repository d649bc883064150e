"""Motion in the wall plane: lines where there are lines, velocity where there are none."""

from __future__ import annotations

import casadi as ca

from ibvs_qp.config import ControllerConfig
from ibvs_qp.setpoints.lines import camera_view, line_slot
from ibvs_qp.setpoints.push import WINDUP_FORCE
from ibvs_qp.setpoints.sensed import Body, Touch, Wish, clamp
from ibvs_qp.setpoints.signals import Signals
from ibvs_qp.setpoints.wall import Wall

#: Bound of the velocity integral as an acceleration [m/s^2].
VELOCITY_INTEGRAL_BOUND = 0.8


def motion_in_plane(
    signals: Signals, config: ControllerConfig, body: Body, touch: Touch, wish: Wish, wall: Wall, travel: ca.SX
) -> None:
    """Line errors and wanted accelerations right and down; integrals rest while stuck or while rotors are limited."""
    across = body.velocity - wall.normal * ca.dot(wall.normal, body.velocity)
    slow = ca.norm_2(across) * body.moving < config.contact.stuck_speed_m_s
    stuck = ca.logic_and(touch.touching, slow)
    integrate = ca.logic_and(ca.logic_not(stuck), signals.input("given_up") < WINDUP_FORCE)
    view = camera_view(signals, config, body, touch, wall, travel)
    vertical = signals.input("vertical", config.line_slots)
    right = down = ca.SX(0.0)
    for slot in range(config.line_slots):
        weight = line_slot(signals, config, slot, body, view, integrate)
        right = ca.fmax(right, vertical[slot] * weight)
        down = ca.fmax(down, (1.0 - vertical[slot]) * weight)
    free = signals.output("free", ca.vertcat(1.0 - right, 1.0 - down))
    commands = [
        _velocity_command(signals, config, axis, body, wish, direction, free[axis], integrate)
        for axis, direction in enumerate((wall.right, wall.down))
    ]
    signals.output("velocity_command", ca.vertcat(*commands))


def _velocity_command(
    signals: Signals,
    config: ControllerConfig,
    axis: int,
    body: Body,
    wish: Wish,
    direction: ca.SX,
    free: ca.SX,
    integrate: ca.SX,
) -> ca.SX:
    r"""Acceleration :math:`K_p e + K_i \int e` of the velocity error along one axis; none without a velocity."""
    gains = config.gains
    bound = VELOCITY_INTEGRAL_BOUND / max(gains.velocity_ki, 1e-6)
    error = wish.velocity[axis] - ca.dot(direction, body.velocity)
    old = signals.state(f"velocity_integral_{axis}")
    moved = clamp(free * (old + body.dt * error), -bound, bound)
    integral = ca.if_else(ca.logic_and(body.moving, integrate), moved, old)
    signals.remember(f"velocity_integral_{axis}", integral)
    return ca.if_else(body.moving, gains.velocity_kp * error + gains.velocity_ki * integral, 0.0)
