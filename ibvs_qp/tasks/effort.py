"""Regularisation: thrusts stay near the last ones and change smoothly."""

from __future__ import annotations

import casadi as ca

from ibvs_qp.model.model import Model
from ibvs_qp.model.rows import TaskRow
from ibvs_qp.tasks.task import Task


class EffortTask(Task):
    """Thrusts near the last ones; a pull to zero would be a constant push and height bias."""

    weight_settings = ("weights.effort",)

    def rows(self, model: Model) -> list[TaskRow]:
        """One row per rotor in newtons."""
        return _thrust_rows(model, "effort", model.last_thrust, model.weights.effort)


class SmoothnessTask(Task):
    """The thrust step repeats the last one, so that thrusts bend without corners."""

    weight_settings = ("weights.smoothness",)

    def rows(self, model: Model) -> list[TaskRow]:
        """One row per rotor in newtons."""
        return _thrust_rows(model, "smooth", model.extrapolated_thrust, model.weights.smoothness)


def _thrust_rows(model: Model, name: str, target: ca.SX, weight: ca.SX) -> list[TaskRow]:
    return [
        TaskRow(name=f"{name}_{rotor}", unit="N", expression=model.thrust[i], target=target[i], weight=weight)
        for i, rotor in enumerate(model.config.vehicle.geometry.names)
    ]
