"""Velocity in the wall plane, for the directions that no line fixes."""

from __future__ import annotations

from typing import Any

import casadi as ca

from ibvs_qp.model.inputs import LEAST_GAIN
from ibvs_qp.model.model import Model
from ibvs_qp.model.rows import TaskRow
from ibvs_qp.symbolic.logic import clamp
from ibvs_qp.tasks.line import free_directions
from ibvs_qp.tasks.task import Task

#: Weight with a rotor lost or stuck, over that of a level vehicle [-]: the force that is left damps the drift.
FAULTY_WEIGHT = 0.02
#: Bound of the velocity integral as an acceleration [m/s^2].
VELOCITY_INTEGRAL_BOUND = 0.8


class VelocityTask(Task):
    r"""Acceleration :math:`K_p e + K_i \int e` of the velocity error e along right and down of the wall plane.

    The proportional part takes e less T times the acceleration of the lagged thrusts, T the lead against the motors'
    lag; `Model.filtered` follows.
    """

    weight_settings = ("weights.velocity",)

    def rows(self, model: Model) -> list[TaskRow]:
        """Two rows in m/s^2; a line of full weight takes the weight of its direction away."""
        paper = model.config.line_profile == "paper"  # there the rows are null-space targets and count in full
        free = ca.SX.ones(2) if paper else free_directions(model)
        weights, target = model.weights, velocity_command(model)
        extra = 0.0 if paper else model.tip_stationary * (stationary_sideways_weight(weights) - weights.velocity)
        # Without a rotor one force is not free, and the vehicle tilts to move: at the wall the one into it counts more.
        faulty = ca.fmax(model.attitude.tilted, model.attitude.trimmed)
        level = 1.0 - faulty + FAULTY_WEIGHT * faulty
        row_weights = ((weights.velocity + extra) * free[0] * level, weights.velocity * free[1])
        return [
            TaskRow(
                name=f"velocity_{name}",
                unit="m/s^2",
                expression=ca.dot(direction, model.acceleration[:3]),
                target=target[axis],
                weight=row_weights[axis],
            )
            for axis, (name, direction) in enumerate((("right", model.wall.right), ("down", model.wall.down)))
        ]


def stationary_sideways_weight(weights: Any) -> ca.SX:
    """Weight of the sideways velocity row while friction holds the tip: that of height, if larger.

    The vehicle swings about a stationary tip, and this row damps the swing. A push beyond reach takes from every row
    by its weight: at the weight of a sliding vehicle and with stiff velocity gains 40 N make the yaw grow to 2.4 deg.
    """
    return ca.if_else(weights.velocity > 0.0, ca.fmax(weights.velocity, weights.height), 0.0)


def velocity_command(model: Model) -> ca.SX:
    """Accelerations right and down [m/s^2], (2,); before the filter zero while no velocity is known."""
    return model.once(("velocity",), lambda: model.output("velocity_command", ca.vertcat(*_commands(model))))


def _commands(model: Model) -> list[ca.SX]:
    gains, body, free = model.gains, model.body, free_directions(model)
    bound = VELOCITY_INTEGRAL_BOUND / ca.fmax(gains.velocity_ki, LEAST_GAIN)
    axes = ((model.wall.right, model.target.velocity_right), (model.wall.down, model.target.velocity_down))
    commands = []
    for axis, (direction, target) in enumerate(axes):
        error = target - ca.dot(direction, body.velocity)
        old = model.signals.state(f"velocity_integral_{axis}")
        moved = clamp(free[axis] * (old + body.dt * error), -bound, bound)
        integral = ca.if_else(ca.logic_and(body.velocity_known, model.integrate_in_plane), moved, old)
        model.signals.remember(f"velocity_integral_{axis}", integral)
        row = ca.dot(direction, model.acceleration[:3])
        ahead = error - gains.velocity_lead_s * model.at(row, model.acceleration_now)
        command = gains.velocity_kp * ahead + gains.velocity_ki * integral
        command = ca.if_else(body.velocity_known, command, 0.0)
        commands.append(model.filtered(command, row, gains.velocity_filter_s))
    return commands
