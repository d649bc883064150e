"""Barriers on angles: soft bounds on the acceleration that keep an angle inside its bound."""

from __future__ import annotations

import casadi as ca

from ibvs_qp.limits.limit import Limit
from ibvs_qp.model.rows import LimitRow, SymbolicModel


def barrier_bounds(angle: ca.SX, rate: ca.SX, bound: float, pole: float) -> tuple[ca.SX, ca.SX]:
    r"""Acceleration bounds of an exponential barrier with both poles at -p.

    For :math:`h = \bar\varphi - \varphi` demand :math:`\ddot h + 2p\dot h + p^2 h \ge 0`, so
    :math:`\ddot\varphi \le p^2(\bar\varphi-\varphi) - 2p\dot\varphi`, and mirrored below (Nguyen and Sreenath,
    Exponential control barrier functions, ACC 2016).

    Returns:
        Lower and upper bound of the angular acceleration [rad/s^2].
    """
    damping = -2.0 * pole * rate
    return -(pole**2) * (bound + angle) + damping, pole**2 * (bound - angle) + damping


class TiltLimit(Limit):
    """Zero-tilt barriers on roll and pitch."""

    bounded_by = ("limits.tilt_deg", "limits.tilt_rate_1_s")
    priced_by = "limits.tilt_price"
    switched_by = "limits.tilt_barrier"

    def rows(self, model: SymbolicModel) -> list[LimitRow]:
        """Two soft rows in rad/s^2."""
        settings = model.config.limits
        tilt = model.parameter("tilt_state", 4)
        rows = []
        for axis, name in enumerate(("roll", "pitch")):
            lower, upper = barrier_bounds(
                tilt[axis], tilt[2 + axis], settings.tilt_deg * ca.pi / 180.0, settings.tilt_rate_1_s
            )
            rows.append(
                LimitRow(
                    name=f"tilt_{name}",
                    unit="rad/s^2",
                    expression=model.acceleration[3 + axis],
                    lower=lower,
                    upper=upper,
                    price=self.price(model, settings.tilt_price),
                )
            )
        return rows


class YawLimit(Limit):
    """Yaw barrier about the wall normal: the front propellers strike the wall at 19 degrees."""

    bounded_by = ("limits.yaw_deg", "limits.yaw_rate_1_s")
    priced_by = "limits.yaw_price"
    switched_by = "limits.yaw_barrier"

    def rows(self, model: SymbolicModel) -> list[LimitRow]:
        """One soft row in rad/s^2; the angle is that of the body axis away from the wall normal."""
        settings = model.config.limits
        yaw = model.parameter("yaw_state", 2)
        lower, upper = barrier_bounds(yaw[0], yaw[1], settings.yaw_deg * ca.pi / 180.0, settings.yaw_rate_1_s)
        return [
            LimitRow(
                name="yaw",
                unit="rad/s^2",
                expression=model.acceleration[5],
                lower=lower,
                upper=upper,
                price=self.price(model, settings.yaw_price),
            )
        ]
