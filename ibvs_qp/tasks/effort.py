"""Regularisation: stay near the last thrusts, and change them smoothly."""

from __future__ import annotations

import casadi as ca

from ibvs_qp.model.rows import SymbolicModel, TaskRow
from ibvs_qp.tasks.task import Task


class EffortTask(Task):
    """Thrusts near the last ones; a pull to zero would be a steady push and height bias."""

    weighed_by = ("weights.effort",)

    def rows(self, model: SymbolicModel) -> list[TaskRow]:
        """One row per rotor in newtons."""
        last, weight = model.parameter("last_thrust", model.rotors), ca.SX(model.config.weights.effort)
        names = model.config.vehicle.geometry.names
        return [
            TaskRow(name=f"effort_{names[i]}", unit="N", expression=model.thrust[i], target=last[i], weight=weight)
            for i in range(model.rotors)
        ]


class SmoothnessTask(Task):
    """The thrust step repeats the last one: changes bend, they do not break."""

    weighed_by = ("weights.smoothness",)

    def rows(self, model: SymbolicModel) -> list[TaskRow]:
        """One row per rotor in newtons."""
        next_thrust = model.parameter("extrapolated_thrust", model.rotors)
        weight = ca.SX(model.config.weights.smoothness)
        names = model.config.vehicle.geometry.names
        return [
            TaskRow(
                name=f"smooth_{names[i]}", unit="N", expression=model.thrust[i], target=next_thrust[i], weight=weight
            )
            for i in range(model.rotors)
        ]
