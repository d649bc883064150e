"""Yaw to the wall normal that the depth camera measures."""

from __future__ import annotations

import casadi as ca

from ibvs_qp.model.inputs import clamp
from ibvs_qp.model.model import Model
from ibvs_qp.model.rows import TaskRow
from ibvs_qp.model.stationary_tip import pivot_stiffness
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
        """Yaw acceleration [rad/s^2]."""
        damping = -model.config.gains.yaw_kd * model.body.rate[2]
        facing = -self._stiffness(model) * model.attitude.yaw + damping
        braking = clamp(damping, -ROTOR_LOST_ACCELERATION, ROTOR_LOST_ACCELERATION)
        return ca.if_else(model.attitude.tilted, braking, facing)

    def _stiffness(self, model: Model) -> ca.SX:
        """K_p of yaw [1/s^2], lower while friction alone holds the tip sideways."""
        stiffness, guided = model.config.gains.yaw_kp, ca.SX(0.0)
        if not model.config.contact_feedforward:
            return ca.SX(stiffness)
        for line in model.lines:
            guided = ca.fmax(guided, line.vertical * line.present * line.confidence)
        _, soft = pivot_stiffness(model.config)
        return stiffness + model.tip_stationary * (1.0 - guided) * (min(stiffness, soft) - stiffness)
