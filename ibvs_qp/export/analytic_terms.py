"""Terms of the analytic law as expressions: what the C library needs for its fallback; see `ibvs_qp.analytic`."""

from __future__ import annotations

import casadi as ca

from ibvs_qp.model.model import Model
from ibvs_qp.symbolic.logic import both, where
from ibvs_qp.tasks.line import line_state


def analytic_terms(model: Model) -> list[ca.SX]:
    """Rows of the stacked lines in body axes, their commanded image accelerations, and the secondary acceleration.

    Returns:
        Rows one after the other, (6 (slots + 1),): the row of every line, then the angle of the line nearest the image
        centre; rows of absent lines are zero. Commands, (slots + 1,). Acceleration for their null space, (6,).
    """
    twist = model.camera_twist
    rows, commands = [], []
    level_row, level_command, nearest = ca.SX.zeros(1, 6), ca.SX(0.0), ca.SX(ca.inf)
    for line in model.lines:
        state = line_state(model, line.index)
        rows.append(where(line.present, state.analytic_row, ca.SX.zeros(1, 6)))
        commands.append(where(line.present, state.analytic_command, 0.0))
        if not model.config.analytic_angle_row:
            continue
        nearer = both(line.present, ca.fabs(line.rho) < nearest)
        nearest = where(nearer, ca.fabs(line.rho), nearest)
        level_row = where(nearer, state.row_theta @ twist, level_row)
        level_command = where(nearer, state.angle_command, level_command)
    rows, commands = [*rows, level_row], [*commands, level_command]
    out, wall = model.signals.outputs, model.wall
    standoff = (1.0 - model.contact_weight) * out["standoff_command"] / model.config.vehicle.mass_kg
    right, down = ca.vertsplit(out["velocity_command"])
    linear = wall.normal * standoff + wall.right * right + wall.down * down
    secondary = ca.vertcat(linear, out["level_command"], out["yaw_command"])
    return [ca.vec(ca.vertcat(*rows).T), ca.vertcat(*commands), secondary]
