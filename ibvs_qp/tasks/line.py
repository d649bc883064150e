"""Image-based visual servoing of lines, at the point where the tip meets the wall."""

from __future__ import annotations

import casadi as ca
import numpy as np

from ibvs_qp.frames import camera_twist_matrix
from ibvs_qp.model.rows import SymbolicModel, TaskRow
from ibvs_qp.tasks.task import Task


def symbolic_line_rows(rho: ca.SX, theta: ca.SX, plane: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Rows (rho, theta) of the line interaction matrix for a wall plane (A, B, C) with D = -1 (design, section 3)."""
    c, s = ca.cos(theta), ca.sin(theta)
    a, b, depth = plane[0], plane[1], plane[2]
    l_t = -(a * s - b * c)
    l_r = -(a * rho * c + b * rho * s + depth)
    row_rho = ca.horzcat(l_r * c, l_r * s, -l_r * rho, (1 + rho**2) * s, -(1 + rho**2) * c, 0)
    row_theta = ca.horzcat(l_t * c, l_t * s, -l_t * rho, -rho * c, -rho * s, -1)
    return row_rho, row_theta


class LineTask(Task):
    r"""A line of the picture goes where its reference is, as seen from the tip's wall point; one task a slot.

    Its rows ask for :math:`L S \dot\nu = -(K_p e + K_d \dot e + K_i \int e)`. The error row is
    :math:`L_\rho + (x_t \sin\theta - y_t \cos\theta) L_\theta`, the motion of the line relative to the image
    (x_t, y_t) of the tip's wall point: endpoint closed loop. The angle row yields to level flight.
    """

    weighed_by = ("weights.line", "weights.line_angle")

    def __init__(self, slot: int) -> None:
        self.slot = slot

    def rows(self, model: SymbolicModel) -> list[TaskRow]:
        """Two rows: error at the tip [1/s^2] and angle [rad/s^2]."""
        name = f"line_{self.slot}"
        line = model.parameter(name, 8)  # rho, theta, x_t, y_t, wanted accelerations (2), weights (2)
        twist = ca.DM(camera_twist_matrix(np.array(model.config.vehicle.camera_position_m)))
        row_rho, row_theta = symbolic_line_rows(line[0], line[1], model.parameter("plane", 3))
        tip = row_rho + (line[2] * ca.sin(line[1]) - line[3] * ca.cos(line[1])) * row_theta
        motion = twist @ model.motion_acceleration
        return [
            TaskRow(name=name, unit="1/s^2", expression=tip @ motion, target=line[4], weight=line[6]),
            TaskRow(
                name=f"{name}_angle", unit="rad/s^2", expression=row_theta @ motion, target=line[5], weight=line[7]
            ),
        ]
