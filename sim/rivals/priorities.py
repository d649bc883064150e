"""Priority levels of the task rows, and the rows as values of a tick."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
import numpy as np

from ibvs_qp.limits.limit import Limit
from ibvs_qp.model.model import Model
from ibvs_qp.qp.problem import AffineRows, QpProblem
from ibvs_qp.tasks.task import Task

#: Task rows by the start of their names, highest priority first. The order is that of the shipped weights per squared
#: newton of thrust or force: roll and pitch 1900 and yaw 110 (400 over inertia, times lever), height 44, lines 11,
#: velocity 2.8, push and stand-off 0.5, and the rest at most 0.001. Height, lines and velocity command the same two
#: directions, so they share a level. Other orders fly worse: with yaw beside roll and pitch a vehicle that lost a
#: rotor brakes its turn and strikes the wall; with the push above height a push beyond reach lifts the tip by 28 mm.
LEVELS: tuple[tuple[str, ...], ...] = (
    ("roll", "pitch"),
    ("yaw",),
    ("height", "line", "velocity"),
    ("push", "standoff"),
    ("effort", "smooth"),
)
#: End of the names of angle rows; at 0.05 rad they belong to the lowest level: a sloped edge must not tilt.
ANGLE = "_angle"


def row_levels(names: Sequence[str], levels: Sequence[Sequence[str]] = LEVELS) -> list[np.ndarray]:
    """Indices of the rows of every level; a row of an unknown name and an angle row have the lowest priority."""
    found: list[list[int]] = [[] for _ in levels]
    for index, name in enumerate(names):
        fits = [k for k, starts in enumerate(levels) if name.startswith(tuple(starts)) and not name.endswith(ANGLE)]
        found[fits[0] if fits else -1].append(index)
    return [np.array(indices, int) for indices in found]


class PriorityProblem(QpProblem):
    """The shipped rows, and in addition to the weighted program the rows one by one: matrix, target and weight.

    Attributes:
        levels: Indices of the task rows of every level, highest priority first.
    """

    def __init__(self, model: Model, tasks: Sequence[Task], limits: Sequence[Limit]) -> None:
        super().__init__(model, tasks, limits)
        rows = AffineRows(model, ca.vertcat(*(row.expression for row in self.task_rows)))
        targets = ca.vertcat(*(row.target for row in self.task_rows)) - rows.constant
        weights = ca.vertcat(*(row.weight for row in self.task_rows))
        self.values += [ca.vec(ca.densify(rows.per_thrust)), ca.densify(targets), ca.densify(weights)]
        self.levels = row_levels([row.name for row in self.task_rows])
