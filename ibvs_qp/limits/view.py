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
    for the vertical ones, however many lines there are. Without a visible line the row's bounds are +-WIDE.
    """

    bound_settings = ("limits.view_down", "limits.view_right", "limits.view_rate_1_s")
    slack_weight_setting = "limits.view_slack_weight"
    switch_setting = "limits.view_barrier"

    def rows(self, model: Model) -> list[LimitRow]:
        """Two soft rows in 1/s^2."""
        settings, rows = model.config.limits, []
        for role, bound in ((HORIZONTAL, settings.view_down), (VERTICAL, settings.view_right)):
            rho, theta, rate, visible = ca.vertsplit(outermost_line(model, role))
            row, _ = symbolic_line_rows(rho, theta, model.view.plane)
            lower, upper = barrier_bounds(rho, rate, bound, settings.view_rate_1_s)
            rows.append(
                LimitRow(
                    name=f"view_{role}",
                    unit="1/s^2",
                    expression=row @ model.camera_acceleration,
                    lower=ca.if_else(visible, lower, -WIDE),
                    upper=ca.if_else(visible, upper, WIDE),
                    slack_weight=self.slack_weight(model, settings.view_slack_weight),
                )
            )
        return rows


def outermost_line(model: Model, role: str) -> ca.SX:
    """(rho, theta, rate of rho, visible) of the line of a role nearest to the picture's border, (4,)."""
    state = ca.SX.zeros(4)
    for line in model.lines:
        visible = line.present * (line.vertical if role == VERTICAL else 1.0 - line.vertical)
        outer = ca.logic_or(ca.logic_not(state[3]), ca.fabs(line.rho) > ca.fabs(state[0]))
        rate = line_state(model, line.index).image_rate
        state = ca.if_else(ca.logic_and(visible, outer), ca.vertcat(line.rho, line.theta, rate, visible), state)
    return state
