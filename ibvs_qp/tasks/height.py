"""Height along the wall, kept while a push or a sideways motion is out of reach."""

from __future__ import annotations

import casadi as ca

from ibvs_qp.model.model import Model
from ibvs_qp.model.rows import TaskRow
from ibvs_qp.tasks.level import LevelTask
from ibvs_qp.tasks.line import LineTask, free_directions, line_state
from ibvs_qp.tasks.task import Task
from ibvs_qp.tasks.velocity import velocity_command
from ibvs_qp.tasks.yaw import YawTask

#: Image motion per vertical motion below which a line does not measure height [1/m].
LEAST_SENSITIVITY = 0.1
#: Least sum of weights; it keeps the average finite.
LEAST_WEIGHT = 1e-6


class HeightTask(Task):
    r"""Acceleration along down of the wall plane, weighted far above push and sideways motion.

    Its target equals the vertical demand of the line or velocity task; it only adds priority when thrust
    saturates. A rotor at its idle floor adds lift: with push, sideways motion and height weighted alike the program
    lets the vehicle climb by a third of the missing force. A horizontal line demands :math:`r^T \dot\nu = \ddot e`
    with r its row. With roll, pitch, yaw and sideways motion at their targets the rest of it is vertical:

    .. math::
        a_{down} = \frac{\ddot e - r_\Omega^T \dot\Omega_{target} - (r_V^T d_{right})\, a_{right}}{r_V^T d_{down}}.

    The row has no angular acceleration: a line row of the same weight would trade roll and pitch for height.
    """

    weight_settings = ("weights.height",)

    def rows(self, model: Model) -> list[TaskRow]:
        """One row in m/s^2."""
        return [
            TaskRow(
                name="height",
                unit="m/s^2",
                expression=ca.dot(model.wall.down, model.acceleration[:3]),
                target=model.output("height_command", self.target(model)),
                weight=model.weights.height,
            )
        ]

    def target(self, model: Model) -> ca.SX:
        """Vertical acceleration that lines and free velocity demand, averaged by weight [m/s^2]."""
        free, velocity = free_directions(model), velocity_command(model)
        rotation = model.body_rotation_gain * ca.vertcat(LevelTask().targets(model), YawTask().target(model))
        sideways, guided = free[0] * velocity[0], model.weights.line > 0.0
        total, weight = free[1] * velocity[1], free[1]
        for line in model.lines:
            task = LineTask(line.index)
            row = (task.error_row(model) @ model.camera_twist).T
            down, right = ca.dot(row[:3], model.wall.down), ca.dot(row[:3], model.wall.right)
            sensitive = ca.fabs(down) > LEAST_SENSITIVITY
            part = (1.0 - line.vertical) * sensitive * line_state(model, line.index).weight * guided
            rest = task.target(model) - ca.dot(row[3:], rotation) - right * sideways
            total = total + part * rest / ca.if_else(sensitive, down, 1.0)
            weight = weight + part
        return total / ca.fmax(weight, LEAST_WEIGHT)
