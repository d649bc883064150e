"""Motion in the wall plane: lines where there are lines, velocity where there are none."""

from __future__ import annotations

import casadi as ca

from ibvs_qp.config import ControllerConfig
from ibvs_qp.measurement import HORIZONTAL, VERTICAL
from ibvs_qp.model.inputs import Body, Touch, Wish, clamp
from ibvs_qp.model.lines import SlotLine, camera_view, line_slot
from ibvs_qp.model.push import WINDUP_FORCE
from ibvs_qp.model.signals import Signals
from ibvs_qp.model.wall import Wall

#: Bound of the velocity integral as an acceleration [m/s^2].
VELOCITY_INTEGRAL_BOUND = 0.8
#: Farther from the image centre than any line that is let in [normalised].
FAR = 1e3


def motion_in_plane(
    signals: Signals, config: ControllerConfig, body: Body, touch: Touch, wish: Wish, wall: Wall, travel: ca.SX
) -> None:
    """Line errors and wanted accelerations right and down; integrals rest while stuck or while rotors are limited."""
    # The body's velocity, not the tip's: a tip that creeps at high friction must not stop the integral that frees it.
    across = body.velocity - wall.normal * ca.dot(wall.normal, body.velocity)
    slow = ca.norm_2(across) * body.moving < config.contact.stuck_speed_m_s
    stuck = ca.logic_and(touch.touching, slow)
    integrate = ca.logic_and(ca.logic_not(stuck), signals.input("given_up") < WINDUP_FORCE)
    view = camera_view(signals, config, body, touch, wall, travel)
    vertical = signals.input("vertical", config.line_slots)
    lines = [line_slot(signals, config, slot, body, view, integrate) for slot in range(config.line_slots)]
    right = down = ca.SX(0.0)
    for slot, line in enumerate(lines):
        right = ca.fmax(right, vertical[slot] * line.weight)
        down = ca.fmax(down, (1.0 - vertical[slot]) * line.weight)
    free = signals.output("free", ca.vertcat(1.0 - right, 1.0 - down))
    _outermost(signals, HORIZONTAL, lines, [1.0 - vertical[slot] for slot in range(len(lines))])
    _outermost(signals, VERTICAL, lines, [vertical[slot] for slot in range(len(lines))])
    if config.line_profile == "paper":
        _one_angle_row(signals, config, lines)
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


def _outermost(signals: Signals, role: str, lines: list[SlotLine], belongs: list[ca.SX]) -> None:
    """State of the line of a role nearest to the picture's border, for the line-in-view barrier."""
    state = ca.SX.zeros(4)
    for line, share in zip(lines, belongs, strict=True):
        seen = line.present * share
        farther = ca.logic_and(seen, ca.logic_or(ca.logic_not(state[3]), ca.fabs(line.rho) > ca.fabs(state[0])))
        state = ca.if_else(farther, ca.vertcat(line.rho, line.theta, line.rate, seen), state)
    signals.output(f"view_{role}", state)


def _one_angle_row(signals: Signals, config: ControllerConfig, lines: list[SlotLine]) -> None:
    """Paper profile: of all angle rows only that of the line nearest to the image centre counts, in full."""
    nearest = ca.SX(FAR)
    for line in lines:
        nearest = ca.fmin(nearest, ca.if_else(line.present, ca.fabs(line.rho), FAR))
    taken = ca.SX(0.0)
    for slot, line in enumerate(lines):
        row = signals.outputs[f"line_{slot}"]
        chosen = line.present * (ca.fabs(line.rho) <= nearest) * (1.0 - taken)
        taken = taken + chosen
        signals.output(f"line_{slot}", ca.vertcat(row[:7], chosen * config.weights.line * line.weight))
