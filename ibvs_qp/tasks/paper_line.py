"""The paper's line task: rho at the image centre, and one angle row."""

from __future__ import annotations

from typing import Any

import casadi as ca

from ibvs_qp.model.model import Model
from ibvs_qp.model.rows import TaskRow
from ibvs_qp.tasks.line import LineTask, image_command, line_state

#: Farther from the image centre than any line that validation accepts [normalised].
FAR = 1e3


class PaperLineTask(LineTask):
    r"""One line of the picture converges to its reference at the image centre (``line_profile = "paper"``).

    Of all angle rows only that of the line nearest to the image centre has a weight: the difference of the angle rows
    of a horizontal and a vertical line commands pitch through a lever of rho.
    """

    weight_settings = ("weights.line", "weights.line")

    def error_row(self, model: Model) -> ca.SX:
        """Row rho of the interaction matrix, (1, 6)."""
        return line_state(model, self.index).row_rho

    def target(self, model: Model) -> ca.SX:
        """Image acceleration of rho [1/s^2]."""
        line, row = line_state(model, self.index), self.error_row(model) @ model.camera_acceleration
        return image_command(model, row, line.rho_error, line.rho_rate, line.integral)

    def rows(self, model: Model) -> list[TaskRow]:
        """Two rows: rho [1/s^2] and angle [rad/s^2]."""
        rho, angle = super().rows(model)
        weight = model.weights.line * line_state(model, self.index).weight
        changes: dict[str, Any] = {"weight": weight * _nearest(model)[self.index]}
        return [rho, TaskRow(**(vars(angle) | changes))]


def _nearest(model: Model) -> list[ca.SX]:
    """For every line 1 if it is the first of those nearest to the image centre."""

    def compute() -> list[ca.SX]:
        nearest, taken, chosen = ca.SX(FAR), ca.SX(0.0), []
        for line in model.lines:
            nearest = ca.fmin(nearest, ca.if_else(line.present, ca.fabs(line.rho), FAR))
        for line in model.lines:
            chosen.append(line.present * (ca.fabs(line.rho) <= nearest) * (1.0 - taken))
            taken = taken + chosen[-1]
        return chosen

    return model.once(("nearest line",), compute)
