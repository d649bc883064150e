"""Height along the wall, kept where a push or a sideways wish is out of reach."""

from __future__ import annotations

import casadi as ca

from ibvs_qp.model.rows import SymbolicModel, TaskRow
from ibvs_qp.tasks.task import Task


class HeightTask(Task):
    """Acceleration along down of the wall plane, weighted far above push and sideways motion.

    It asks for nothing new: its target is what the horizontal line (or the velocity law) already wants of that
    direction, so an unlimited tick is flown as without it. On a limited tick it decides who pays. A rotor that has met
    its idle floor adds lift; with push, sideways and height weighted alike the program lets the vehicle climb by a
    third of what is missing. The row holds no angular acceleration: a line row of the same weight would trade roll and
    pitch for height through its lever.
    """

    weighed_by = ("weights.height",)

    def rows(self, model: SymbolicModel) -> list[TaskRow]:
        """One row in m/s^2."""
        height = model.parameter("height", 2)
        return [
            TaskRow(
                name="height",
                unit="m/s^2",
                expression=ca.dot(model.parameter("axis_down", 3), model.acceleration[:3]),
                target=height[0],
                weight=height[1],
            )
        ]
