"""What the assembly refuses: rows of one name, rows that are not affine in the thrusts, slack that costs nothing."""

from __future__ import annotations

import math
from collections.abc import Sequence

import casadi as ca

from ibvs_qp.config.errors import ConfigError
from ibvs_qp.model.rows import LimitRow, SymbolicModel, TaskRow


def check_rows(model: SymbolicModel, tasks: Sequence[TaskRow], limits: Sequence[LimitRow]) -> None:
    """Refuse rows that make no program.

    A task and a limit may share a name ("yaw" is both); two tasks or two limits may not, because reports, prices and
    conflicts speak of rows by name.

    Raises:
        ConfigError: Naming the row and what is wrong with it.
    """
    _refuse_namesakes("task", [row.name for row in tasks])
    _refuse_namesakes("limit", [row.name for row in limits])
    for task in tasks:
        _refuse_curved(model, f"task {task.name}", task.expression, target=task.target, weight=task.weight)
    for limit in limits:
        _refuse_curved(model, f"limit {limit.name}", limit.expression, lower=limit.lower, upper=limit.upper)
        if limit.price is not None and not 0.0 < limit.price < math.inf:
            raise ConfigError(
                f"limit {limit.name}: price = {limit.price!r} is refused: greater than 0 and finite, None if it is hard"
            )


def _refuse_namesakes(kind: str, names: list[str]) -> None:
    for name in names:
        if names.count(name) > 1:
            raise ConfigError(f"{kind} rows need names of their own: {name!r} is there {names.count(name)} times")


def _refuse_curved(model: SymbolicModel, row: str, expression: ca.SX, **others: ca.SX) -> None:
    unknown = ca.veccat(model.thrust, model.acceleration)
    if ca.depends_on(ca.jacobian(expression, unknown), unknown):
        raise ConfigError(f"{row}: its expression must be affine in the thrusts")
    for what, symbol in others.items():
        if ca.depends_on(ca.SX(symbol), unknown):
            raise ConfigError(f"{row}: its {what} must not depend on the thrusts")
