"""Velocity in the wall plane, for the directions that no line fixes."""

from __future__ import annotations

import casadi as ca

from ibvs_qp.model.rows import SymbolicModel, TaskRow
from ibvs_qp.tasks.task import Task


class VelocityTask(Task):
    """Acceleration along right and down of the wall plane (PI law on the estimated velocity)."""

    weighed_by = ("weights.velocity",)

    def rows(self, model: SymbolicModel) -> list[TaskRow]:
        """Two rows in m/s^2; a line of full weight takes its direction's weight away."""
        rows = []
        for name in ("right", "down"):
            direction = model.parameter(f"axis_{name}", 3)
            velocity = model.parameter(f"velocity_{name}", 2)
            rows.append(
                TaskRow(
                    name=f"velocity_{name}",
                    unit="m/s^2",
                    expression=ca.dot(direction, model.acceleration[:3]),
                    target=velocity[0],
                    weight=velocity[1],
                )
            )
        return rows
