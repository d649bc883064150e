"""Level flight: the paper's zero-tilt strategy."""

from __future__ import annotations

import casadi as ca

from ibvs_qp.model.model import Model
from ibvs_qp.model.rows import TaskRow
from ibvs_qp.model.stationary_tip import pivot_stiffness
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
                weight=ca.SX(model.config.weights.level),
            )
            for axis, name in enumerate(("roll", "pitch"))
        ]

    def targets(self, model: Model) -> ca.SX:
        """Roll and pitch accelerations [rad/s^2], (2,)."""
        stiffness = ca.vertcat(model.config.gains.attitude_kp, self._pitch_stiffness(model))
        return -stiffness * model.attitude.tilt_error - model.config.gains.attitude_kd * model.attitude.tilt_rate

    def _pitch_stiffness(self, model: Model) -> ca.SX:
        """K_p of pitch [1/s^2], lower while friction alone holds the tip vertically."""
        stiffness, guided = model.config.gains.attitude_kp, ca.SX(0.0)
        if not model.config.contact_feedforward:
            return ca.SX(stiffness)
        for line in model.lines:
            guided = ca.fmax(guided, (1.0 - line.vertical) * line.present * line.confidence)
        soft, _ = pivot_stiffness(model.config)
        return stiffness + model.tip_stationary * (1.0 - guided) * (min(stiffness, soft) - stiffness)
