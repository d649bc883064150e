"""Level flight: the paper's zero-tilt strategy."""

from __future__ import annotations

import casadi as ca

from ibvs_qp.model.feedforward import pivot_stiffness
from ibvs_qp.model.model import Model
from ibvs_qp.model.rows import TaskRow
from ibvs_qp.tasks.task import Task


class LevelTask(Task):
    r"""Roll and pitch accelerations :math:`-K_p \varphi - K_d \dot\varphi` that bring the vehicle level."""

    weight_settings = ("weights.level",)

    def rows(self, model: Model) -> list[TaskRow]:
        """Two rows in rad/s^2."""
        targets = model.output("level_command", self.targets(model))
        return [
            TaskRow(
                name=name,
                unit="rad/s^2",
                expression=model.acceleration[3 + axis],
                target=targets[axis],
                weight=model.weights.level,
            )
            for axis, name in enumerate(("roll", "pitch"))
        ]

    def targets(self, model: Model) -> ca.SX:
        """Roll and pitch accelerations [rad/s^2], (2,); softer in pitch while friction alone holds the tip."""
        gains, (soft, _) = model.gains, pivot_stiffness(model.config, model.gains)
        level = [1.0 - line.vertical for line in model.lines]
        stiffness = ca.vertcat(gains.attitude_kp, model.pivot_limited(gains.attitude_kp, soft, level))
        target = -stiffness * model.attitude.tilt_error - gains.attitude_kd * model.attitude.tilt_rate_ahead
        return model.filtered(target, model.acceleration[3:5], gains.attitude_filter_s)
