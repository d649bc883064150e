"""Rows that the assembly refuses: duplicate names, rows not affine in the thrusts, slack without weight."""

from __future__ import annotations

import math
from collections.abc import Sequence

import casadi as ca

from ibvs_qp.config.errors import ConfigError
from ibvs_qp.model.model import Model
from ibvs_qp.model.rows import LimitRow, TaskRow


def check_rows(model: Model, tasks: Sequence[TaskRow], limits: Sequence[LimitRow]) -> None:
    """Refuse rows that the program cannot contain.

    A task and a limit may share a name ("yaw" is both); two tasks or two limits may not, because reports name rows.

    Raises:
        ConfigError: Naming the row and its fault.
    """
    _refuse_duplicates("task", [row.name for row in tasks])
    _refuse_duplicates("limit", [row.name for row in limits])
    for task in tasks:
        _refuse_curved(model, f"task {task.name}", task.expression, target=task.target, weight=task.weight)
    for limit in limits:
        _refuse_curved(model, f"limit {limit.name}", limit.expression, lower=limit.lower, upper=limit.upper)
        weight = limit.slack_weight
        if weight is not None and not 0.0 < weight < math.inf:
            allowed = "greater than 0 and finite, None if it is hard"
            raise ConfigError(f"limit {limit.name}: slack_weight = {weight!r} is refused: {allowed}")


def _refuse_duplicates(kind: str, names: list[str]) -> None:
    for name in names:
        if names.count(name) > 1:
            raise ConfigError(f"{kind} rows need unique names: {name!r} appears {names.count(name)} times")


def _refuse_curved(model: Model, row: str, expression: ca.SX, **others: ca.SX) -> None:
    unknown = ca.veccat(model.thrust, model.acceleration)
    if ca.depends_on(ca.jacobian(expression, unknown), unknown):
        raise ConfigError(f"{row}: its expression must be affine in the thrusts")
    for what, symbol in others.items():
        if ca.depends_on(ca.SX(symbol), unknown):
            raise ConfigError(f"{row}: its {what} must not depend on the thrusts")
