"""Line-in-view barrier: what guides the vehicle must not leave the picture."""

from __future__ import annotations

import casadi as ca
import numpy as np

from ibvs_qp.frames import camera_twist_matrix
from ibvs_qp.limits.barrier import barrier_bounds
from ibvs_qp.limits.limit import WIDE, Limit
from ibvs_qp.measurement import HORIZONTAL, VERTICAL
from ibvs_qp.model.rows import LimitRow, SymbolicModel
from ibvs_qp.tasks.line import symbolic_line_rows


class ViewLimit(Limit):
    r"""The outermost guide of each role stays in the picture.

    The rows bound its motion :math:`\ddot\rho = L_\rho S \dot\nu`: one for the level lines and one for the upright
    ones, however many lines there are. The one nearest to the border speaks for its role; without a line the row is as
    wide as the sky.
    """

    bounded_by = ("limits.view_down", "limits.view_right", "limits.view_rate_1_s")
    priced_by = "limits.view_price"
    switched_by = "limits.view_barrier"

    def rows(self, model: SymbolicModel) -> list[LimitRow]:
        """Two soft rows in 1/s^2."""
        settings = model.config.limits
        twist = ca.DM(camera_twist_matrix(np.array(model.config.vehicle.camera_position_m)))
        rows = []
        for role, bound in ((HORIZONTAL, settings.view_down), (VERTICAL, settings.view_right)):
            rho, theta, rate, seen = ca.vertsplit(model.parameter(f"view_{role}", 4))
            row, _ = symbolic_line_rows(rho, theta, model.parameter("plane", 3))
            lower, upper = barrier_bounds(rho, rate, bound, settings.view_rate_1_s)
            rows.append(
                LimitRow(
                    name=f"view_{role}",
                    unit="1/s^2",
                    expression=row @ (twist @ model.motion_acceleration),
                    lower=ca.if_else(seen, lower, -WIDE),
                    upper=ca.if_else(seen, upper, WIDE),
                    price=self.price(model, settings.view_price),
                )
            )
        return rows
