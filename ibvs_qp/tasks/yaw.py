"""Yaw to the wall normal that the depth camera measures."""

from __future__ import annotations

import math

import casadi as ca

from ibvs_qp.model.feedforward import pivot_stiffness
from ibvs_qp.model.model import Model
from ibvs_qp.model.rows import TaskRow
from ibvs_qp.symbolic.logic import clamp
from ibvs_qp.tasks.task import Task

#: With a rotor lost: largest yaw acceleration [rad/s^2] and weight over that of a level vehicle [-]. The moment that is
#: left about the vertical has one sign; yaw takes the remainder of roll and pitch.
LOST_ACCELERATION, LOST_WEIGHT = 2.0, 0.05
#: Beyond this angle a vehicle that lost a rotor only damps the turn [rad].
LARGEST_TURN = 0.5 * math.pi


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
                weight=model.weights.yaw * ca.if_else(model.attitude.tilted, LOST_WEIGHT, 1.0),
            )
        ]

    def target(self, model: Model) -> ca.SX:
        """Yaw acceleration [rad/s^2]; softer while friction alone holds the tip sideways."""
        gains, (_, soft) = model.gains, pivot_stiffness(model.config, model.gains)
        stiffness = model.pivot_limited(gains.yaw_kp, soft, [line.vertical for line in model.lines])
        damping = -gains.yaw_kd * model.rate_ahead[2]
        facing = -stiffness * model.attitude.yaw + damping
        turned = ca.fabs(model.attitude.yaw) > LARGEST_TURN  # behind the seam at 180 degrees it would drive the spin
        bounded = clamp(ca.if_else(turned, damping, facing), -LOST_ACCELERATION, LOST_ACCELERATION)
        target = ca.if_else(model.attitude.tilted, bounded, facing)
        return model.filtered(target, model.acceleration[5], gains.yaw_filter_s)
