"""Bounds along the wall normal: how hard the brush may press, and how fast it may come."""

from __future__ import annotations

import casadi as ca

from ibvs_qp.limits.limit import WIDE, Limit
from ibvs_qp.model.rows import LimitRow, SymbolicModel


class PushCeiling(Limit):
    r"""The push stays below a ceiling, 1.5 times the reference by default.

    Against a wall of stiffness k the push obeys :math:`m \ddot f = k (F_n - f)` with the net force F_n along n. The
    barrier :math:`\ddot h + 2p\dot h + p^2 h \ge 0` on :math:`h = f_{max} - f` with its poles at the contact's own
    :math:`p = \sqrt{k/m}` reads :math:`F_n \le f_{max} + 2\sqrt{k m}\,\dot e_s`: no more than the ceiling, and less
    while the tip still closes in. A closing speed within the noise of its estimate counts as none: times
    :math:`2\sqrt{k m}`, at a stiff wall 500 N s/m, it would be newtons.
    """

    bounded_by = ("limits.push_share", "limits.push_quiet_m_s")
    priced_by = "limits.push_price"
    switched_by = "limits.push_barrier"

    def rows(self, model: SymbolicModel) -> list[LimitRow]:
        """One soft row in newtons; wide before touch."""
        ceiling, stiffness, rate, touching = ca.vertsplit(model.parameter("push_state", 4))
        settings, mass = model.config.limits, model.config.vehicle.mass_kg
        bound = ceiling + 2.0 * ca.sqrt(stiffness * mass) * ca.fmin(rate + settings.push_quiet_m_s, 0.0)
        return [
            LimitRow(
                name="push_ceiling",
                unit="N",
                expression=ca.dot(model.normal, model.wrench[:3]),
                lower=ca.SX(-WIDE),
                upper=ca.if_else(touching, bound, WIDE),
                price=self.price(model, settings.push_price),
            )
        ]


class ApproachLimit(Limit):
    r"""The tip never closes in faster than the approach allows at its distance.

    First-order barrier on :math:`h = v_{max}(e_s) + \dot e_s`: :math:`n^T \dot V \le p\,h`. What the approach leans
    on a wall that it does not feel yet is no acceleration and is let through.
    """

    bounded_by = ("limits.approach_share", "limits.approach_rate_1_s")
    priced_by = "limits.approach_price"
    switched_by = "limits.approach_barrier"

    def rows(self, model: SymbolicModel) -> list[LimitRow]:
        """One soft row in m/s^2; wide in contact and while the wall is unknown."""
        allowed, rate, leaning, free = ca.vertsplit(model.parameter("approach_state", 4))
        settings = model.config.limits
        bound = settings.approach_rate_1_s * (settings.approach_share * allowed + rate) + leaning
        return [
            LimitRow(
                name="approach_speed",
                unit="m/s^2",
                expression=ca.dot(model.normal, model.acceleration[:3]),
                lower=ca.SX(-WIDE),
                upper=ca.if_else(free, bound, WIDE),
                price=self.price(model, settings.approach_price),
            )
        ]
