"""A limit: a named set of two-sided rows, hard or soft; bounds of an exponential barrier."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from typing import ClassVar

import casadi as ca

from ibvs_qp.model.model import Model
from ibvs_qp.model.rows import LimitRow

#: One degree [rad].
RADIAN = math.radians(1.0)
#: Bound of an inactive row: finite, so that the row never changes its type in OSQP.
WIDE = 1e4


class Limit(ABC):
    """A bound of the program: hard, or soft with a weight per squared unit of slack.

    Only thrust and thrust rate are hard and their intersection is never empty, so the program is feasible by
    construction. Row types never change from step to step.

    Attributes:
        bound_settings: Fields of `ibvs_qp.config.ControllerConfig` with its bounds, units, defaults and reasons.
        slack_weight_setting: Field with the weight of its slack; None for a hard limit.
        switch_setting: Field that removes it from the program.
    """

    bound_settings: ClassVar[tuple[str, ...]] = ()
    slack_weight_setting: ClassVar[str | None] = None
    switch_setting: ClassVar[str | None] = None

    @abstractmethod
    def rows(self, model: Model) -> list[LimitRow]:
        """Rows of the limit, affine in ``model.thrust`` and ``model.acceleration``."""

    @staticmethod
    def slack_weight(model: Model, weight: ca.SX) -> ca.SX | None:
        """Weight of the slack; None with `limits.hard_barriers`."""
        return None if model.config.limits.hard_barriers else weight


def barrier_bounds(angle: ca.SX, rate: ca.SX, bound: float | ca.SX, pole: float) -> tuple[ca.SX, ca.SX]:
    r"""Acceleration bounds of an exponential barrier with both poles at -p.

    For :math:`h = \bar\varphi - \varphi` demand :math:`\ddot h + 2p\dot h + p^2 h \ge 0`, so
    :math:`\ddot\varphi \le p^2(\bar\varphi-\varphi) - 2p\dot\varphi`, and mirrored below (Nguyen and Sreenath,
    Exponential control barrier functions, ACC 2016).

    Returns:
        Lower and upper bound of the angular acceleration [rad/s^2].
    """
    damping = -2.0 * pole * rate
    return -(pole**2) * (bound + angle) + damping, pole**2 * (bound - angle) + damping
