"""Rows of the program: a least-squares row of a task, a two-sided row of a limit, and a parameter of either."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np


@dataclass(frozen=True, kw_only=True)
class TaskRow:
    """One least-squares row: weight * (expression(u) - target)^2 / 2.

    Attributes:
        name: Unique among task rows.
        unit: Of expression and target.
        expression: Affine in `Model.thrust` and `Model.acceleration`.
        target: Independent of both.
        weight: Per squared unit; 0 while the task is absent.
    """

    name: str
    unit: str
    expression: ca.SX
    target: ca.SX
    weight: ca.SX


@dataclass(frozen=True, kw_only=True)
class LimitRow:
    """One two-sided row lower <= expression(u) <= upper.

    Attributes:
        name: Unique among limit rows.
        unit: Of expression and bounds.
        expression: Affine in `Model.thrust` and `Model.acceleration`.
        lower, upper: Bounds, independent of both; finite, so that no row changes its type.
        slack_weight: Slack s costs slack_weight * s^2 / 2; None makes the row hard.
    """

    name: str
    unit: str
    expression: ca.SX
    lower: ca.SX
    upper: ca.SX
    slack_weight: ca.SX | float | None = None


class Parameter:
    """Number of a task or limit that may change between steps; rows contain its symbol (`Model.parameter`).

    Attributes:
        name: Unique among the inputs of the step.
        value: Present value, (size,); assign with ``value[:] =``.
    """

    def __init__(self, name: str, value: float | Sequence[float]) -> None:
        self.name, self.value = name, np.atleast_1d(np.array(value, float))
