"""Limit of the approach speed."""

from __future__ import annotations

import casadi as ca

from ibvs_qp.limits.limit import WIDE, Limit
from ibvs_qp.model.model import Model
from ibvs_qp.model.rows import LimitRow
from ibvs_qp.tasks.standoff import approach


class ApproachLimit(Limit):
    r"""The tip never closes in faster than the approach allows at its distance.

    First-order barrier on :math:`h = v_{max}(e_s) + \dot e_s`: :math:`n^T \dot V \le p\,h`. The search force of the
    approach acts against a wall that the force sensor does not measure yet, without acceleration: it raises the bound.
    """

    bound_settings = ("limits.approach_speed_ratio", "limits.approach_rate_1_s")
    slack_weight_setting = "limits.approach_slack_weight"
    switch_setting = "limits.approach_barrier"

    def rows(self, model: Model) -> list[LimitRow]:
        """One soft row in m/s^2; wide in contact, while the wall is unknown, and after a rotor is lost or stuck."""
        settings, contact, motion = model.limits, model.contact, approach(model)
        barrier = settings.approach_rate_1_s * (settings.approach_speed_ratio * motion.allowed + contact.rate)
        bound = barrier + motion.search / model.config.vehicle.mass_kg
        free = ca.logic_and(contact.known, ca.logic_not(contact.touching))
        # A turning tip is no approach; and where a rotor leaves no force along n, the price would be height.
        faulty = ca.logic_or(model.attitude.tilted, model.attitude.trimmed)
        steady = ca.logic_and(free, ca.logic_not(faulty))
        return [
            LimitRow(
                name="approach_speed",
                unit="m/s^2",
                expression=ca.dot(model.normal, model.acceleration[:3]),
                lower=ca.SX(-WIDE),
                upper=ca.if_else(steady, bound, WIDE),
                slack_weight=self.slack_weight(model, settings.approach_slack_weight),
            )
        ]
