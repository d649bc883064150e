"""Line-in-view barrier: the guiding lines must not leave the picture."""

from __future__ import annotations

import casadi as ca

from ibvs_qp.limits.limit import WIDE, Limit, barrier_bounds
from ibvs_qp.measurement import HORIZONTAL, VERTICAL
from ibvs_qp.model.interaction_matrix import symbolic_line_rows
from ibvs_qp.model.model import Model
from ibvs_qp.model.rows import LimitRow
from ibvs_qp.tasks.line import line_state


class ViewLimit(Limit):
    r"""The outermost line of each role stays in the picture.

    The rows bound its image acceleration :math:`\ddot\rho = L_\rho S \dot\nu`: one row for the horizontal lines, one
    for the vertical ones, however many lines there are. The sign of rho is that of a normal that points down or to the
    right, because the picture need not lie evenly about the camera's axis. Without a visible line the row's bounds are
    +-WIDE.
    """

    bound_settings = (
        "limits.view_up",
        "limits.view_down",
        "limits.view_left",
        "limits.view_right",
        "limits.view_rate_1_s",
    )
    slack_weight_setting = "limits.view_slack_weight"
    switch_setting = "limits.view_barrier"

    def rows(self, model: Model) -> list[LimitRow]:
        """Two soft rows in 1/s^2."""
        settings, rows = model.limits, []
        for role, least, largest in (
            (HORIZONTAL, settings.view_up, settings.view_down),
            (VERTICAL, settings.view_left, settings.view_right),
        ):
            middle, half = 0.5 * (least + largest), 0.5 * (largest - least)
            rho, theta, rate, visible = ca.vertsplit(outermost_line(model, role, middle))
            row, _ = symbolic_line_rows(rho, theta, model.view.plane)
            lower, upper = barrier_bounds(rho - middle, rate, half, settings.view_rate_1_s)
            rows.append(
                LimitRow(
                    name=f"view_{role}",
                    unit="1/s^2",
                    expression=self._expression(model, row),
                    lower=ca.if_else(visible, lower, -WIDE),
                    upper=ca.if_else(visible, upper, WIDE),
                    slack_weight=self.slack_weight(model, settings.view_slack_weight),
                )
            )
        return rows

    def _expression(self, model: Model, row: ca.SX) -> ca.SX:
        """Image acceleration of the line; without that by rotation, which costs less than translation [1/s^2].

        Per unit of the row a rotation costs 400 / 1.1^2, a translation 500: a barrier with both spends most of it on
        pitch.
        """
        if model.config.limits.view_rotation:
            return row @ model.camera_acceleration
        return model.at(row @ model.camera_acceleration, ca.vertcat(model.acceleration[:3], ca.DM.zeros(3)))


def outermost_line(model: Model, role: str, middle: float) -> ca.SX:
    """(rho, theta, rate of rho, visible) of the line of a role farthest from the middle of the picture, (4,).

    Args:
        model: The model.
        role: Role of the lines.
        middle: rho of a line through the middle, with the normal down or to the right.
    """
    state = ca.SX.zeros(4)
    for line in model.lines:
        visible = line.present * (line.vertical if role == VERTICAL else 1.0 - line.vertical)
        along = ca.cos(line.theta) if role == VERTICAL else ca.sin(line.theta)
        mirrored = along < 0.0  # (rho, theta) and (-rho, theta + pi) are one line
        sign = ca.if_else(mirrored, -1.0, 1.0)
        rho, theta = sign * line.rho, line.theta + ca.if_else(mirrored, ca.pi, 0.0)
        outer = ca.logic_or(ca.logic_not(state[3]), ca.fabs(rho - middle) > ca.fabs(state[0] - middle))
        rate = sign * line_state(model, line.index).image_rate
        state = ca.if_else(ca.logic_and(visible, outer), ca.vertcat(rho, theta, rate, visible), state)
    return state
