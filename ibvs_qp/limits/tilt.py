"""Zero-tilt barriers on roll and pitch."""

from __future__ import annotations

import math

import casadi as ca

from ibvs_qp.limits.limit import RADIAN, Limit, barrier_bounds
from ibvs_qp.model.model import Model
from ibvs_qp.model.rows import LimitRow

#: Bound about the target of a vehicle that tilts to move [rad]: at 40 deg/s the target is 0.2 s ahead.
FOLLOWING = math.radians(12.0)


class TiltLimit(Limit):
    """Roll and pitch stay within `limits.tilt_deg` of their targets."""

    bound_settings = ("limits.tilt_deg", "limits.tilt_rate_1_s")
    slack_weight_setting = "limits.tilt_slack_weight"
    switch_setting = "limits.tilt_barrier"

    def rows(self, model: Model) -> list[LimitRow]:
        """Two soft rows in rad/s^2."""
        settings, attitude, rows = model.limits, model.attitude, []
        follows = ca.fmax(attitude.tilted, attitude.trimmed)
        bound = ca.if_else(follows, FOLLOWING, settings.tilt_deg * RADIAN)
        for axis, name in enumerate(("roll", "pitch")):
            angle, rate = attitude.tilt_error[axis], attitude.tilt_rate[axis]
            lower, upper = barrier_bounds(angle, rate, bound, settings.tilt_rate_1_s)
            rows.append(
                LimitRow(
                    name=f"tilt_{name}",
                    unit="rad/s^2",
                    expression=model.acceleration[3 + axis],
                    lower=lower,
                    upper=upper,
                    slack_weight=self.slack_weight(model, settings.tilt_slack_weight),
                )
            )
        return rows
