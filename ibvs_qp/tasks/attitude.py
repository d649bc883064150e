"""Level flight and yaw to the wall normal."""

from __future__ import annotations

from ibvs_qp.model.rows import SymbolicModel, TaskRow
from ibvs_qp.tasks.task import Task


class LevelTask(Task):
    """Roll and pitch accelerations that bring the vehicle level (zero-tilt strategy of the paper)."""

    weighed_by = ("weights.level",)

    def rows(self, model: SymbolicModel) -> list[TaskRow]:
        """Two rows in rad/s^2."""
        level = model.parameter("level", 3)
        return [
            TaskRow(
                name=name, unit="rad/s^2", expression=model.acceleration[3 + axis], target=level[axis], weight=level[2]
            )
            for axis, name in enumerate(("roll", "pitch"))
        ]


class YawTask(Task):
    """Yaw acceleration that faces the wall normal measured by the depth camera."""

    weighed_by = ("weights.yaw",)

    def rows(self, model: SymbolicModel) -> list[TaskRow]:
        """One row in rad/s^2."""
        yaw = model.parameter("yaw", 2)
        return [TaskRow(name="yaw", unit="rad/s^2", expression=model.acceleration[5], target=yaw[0], weight=yaw[1])]
