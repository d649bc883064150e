"""Exponential barrier: acceleration bounds that keep a quantity inside its bound."""

from __future__ import annotations

import casadi as ca


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
