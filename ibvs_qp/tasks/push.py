"""Force along the wall normal: push by impedance, or keep the stand-off; one quantity, two blended wishes."""

from __future__ import annotations

import casadi as ca

from ibvs_qp.model.rows import SymbolicModel, TaskRow
from ibvs_qp.tasks.task import Task


class PushTask(Task):
    r"""Net non-contact force along n equals the force law [N], weight lambda.

    :math:`F_f = F_{ref} + K_{sp} e_s + K_{sd} \dot e_s + K_{fp}(F_{ref} - f) + K_{fi}\int (F_{ref} - f)`.
    """

    weighed_by = ("weights.push",)

    def rows(self, model: SymbolicModel) -> list[TaskRow]:
        """One row in newtons."""
        push = model.parameter("push", 2)
        return [
            TaskRow(
                name="push",
                unit="N",
                expression=ca.dot(model.normal, model.wrench[:3]),
                target=push[0],
                weight=push[1],
            )
        ]


class StandoffTask(Task):
    """Net force along n equals mass times the wanted approach acceleration [N], weight 1 - lambda."""

    weighed_by = ("weights.push",)

    def rows(self, model: SymbolicModel) -> list[TaskRow]:
        """One row in newtons, so that the blend with the push row is linear in lambda."""
        standoff = model.parameter("standoff", 2)
        return [
            TaskRow(
                name="standoff",
                unit="N",
                expression=ca.dot(model.normal, model.wrench[:3]),
                target=standoff[0],
                weight=standoff[1],
            )
        ]
