"""Yaw to the wall normal that the depth camera measures."""

from __future__ import annotations

import casadi as ca

from ibvs_qp.model.inputs import clamp
from ibvs_qp.model.model import Model
from ibvs_qp.model.rows import TaskRow
from ibvs_qp.model.stationary_tip import pivot_limited, pivot_stiffness
from ibvs_qp.tasks.task import Task

#: Largest yaw acceleration of a vehicle that lost a rotor [rad/s^2]: more would cost roll and pitch.
ROTOR_LOST_ACCELERATION = 2.0


class YawTask(Task):
    r"""Yaw acceleration :math:`-K_p \psi - K_d \dot\psi` that faces the wall."""

    weight_settings = ("weights.yaw",)

    def rows(self, model: Model) -> list[TaskRow]:
        """One row in rad/s^2."""
        return [
            TaskRow(
                name="yaw",
                unit="rad/s^2",
                expression=model.acceleration[5],
                target=model.output("yaw_command", self.target(model)),
                weight=ca.SX(model.config.weights.yaw),
            )
        ]

    def target(self, model: Model) -> ca.SX:
        """Yaw acceleration [rad/s^2]; softer while friction alone holds the tip sideways."""
        gains, (_, soft) = model.config.gains, pivot_stiffness(model.config)
        stiffness = pivot_limited(model, gains.yaw_kp, soft, [line.vertical for line in model.lines])
        damping = -gains.yaw_kd * model.rate_ahead[2]
        facing = -stiffness * model.attitude.yaw + damping
        bounded = clamp(facing, -ROTOR_LOST_ACCELERATION, ROTOR_LOST_ACCELERATION)
        return ca.if_else(model.attitude.tilted, bounded, facing)
