"""Yaw barrier about the wall normal."""

from __future__ import annotations

from ibvs_qp.limits.limit import RADIAN, Limit, barrier_bounds
from ibvs_qp.model.model import Model
from ibvs_qp.model.rows import LimitRow


class YawLimit(Limit):
    """Yaw away from the wall normal stays within `limits.yaw_deg`: beyond it a propeller strikes the wall."""

    bound_settings = ("limits.yaw_deg", "limits.yaw_rate_1_s")
    slack_weight_setting = "limits.yaw_slack_weight"
    switch_setting = "limits.yaw_barrier"

    def rows(self, model: Model) -> list[LimitRow]:
        """One soft row in rad/s^2; inactive for a vehicle that lost a rotor and cannot hold yaw."""
        settings, level = model.limits, 1.0 - model.attitude.tilted
        angle, rate = model.attitude.yaw * level, model.body.rate[2] * level
        lower, upper = barrier_bounds(angle, rate, settings.yaw_deg * RADIAN, settings.yaw_rate_1_s)
        return [
            LimitRow(
                name="yaw",
                unit="rad/s^2",
                expression=model.acceleration[5],
                lower=lower,
                upper=upper,
                slack_weight=self.slack_weight(model, settings.yaw_slack_weight),
            )
        ]
