"""Ceiling of the push force."""

from __future__ import annotations

import casadi as ca

from ibvs_qp.limits.limit import WIDE, Limit
from ibvs_qp.model.model import Model
from ibvs_qp.model.rows import LimitRow

#: A closing speed within this many standard deviations of its estimate counts as zero.
QUIET_SIGMAS = 2.0


class PushCeiling(Limit):
    r"""The push stays below a ceiling, 1.5 times the reference by default.

    Against a wall of stiffness k the push obeys :math:`m \ddot f = k (F_n - f)` with the net force F_n along n. The
    barrier :math:`\ddot h + 2p\dot h + p^2 h \ge 0` on :math:`h = f_{max} - f` with its poles at the contact's own
    :math:`p = \sqrt{k/m}` reads :math:`F_n \le f_{max} + 2\sqrt{k m}\,\dot e_s`: no more than the ceiling, and less
    while the tip still closes in. A closing speed within the noise of its estimate counts as zero: times
    :math:`2\sqrt{k m}`, at a stiff wall 500 N s/m, it would be newtons.
    """

    bound_settings = ("limits.push_ceiling_ratio", "limits.push_quiet_m_s")
    slack_weight_setting = "limits.push_slack_weight"
    switch_setting = "limits.push_barrier"

    def rows(self, model: Model) -> list[LimitRow]:
        """One soft row in newtons; wide before touch."""
        settings, contact, mass = model.limits, model.contact, model.config.vehicle.mass_kg
        quiet = ca.fmax(settings.push_quiet_m_s, QUIET_SIGMAS * contact.rate_noise)
        closing = ca.fmin(contact.rate + quiet, 0.0)
        ceiling = settings.push_ceiling_ratio * model.push_reference
        bound = ceiling + 2.0 * ca.sqrt(contact.stiffness * mass) * closing
        return [
            LimitRow(
                name="push_ceiling",
                unit="N",
                expression=model.force_along_normal,
                lower=ca.SX(-WIDE),
                upper=ca.if_else(contact.touching * model.target.press, bound, WIDE),
                slack_weight=self.slack_weight(model, settings.push_slack_weight),
            )
        ]
