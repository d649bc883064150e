"""Redundant thrusts, those that add to no wrench: away from the limits of the rotors."""

from __future__ import annotations

import casadi as ca
import numpy as np

from ibvs_qp.model.model import Model
from ibvs_qp.model.rows import TaskRow
from ibvs_qp.tasks.task import Task

#: Entries of a wrench: as many rotors have no redundant thrusts.
WRENCH_SIZE = 6
#: Time in which the redundant thrusts go to their place [s]: five times the motors' lag.
SETTLING_TIME = 0.3
#: Least distance of a thrust from a limit in the cost [N], a quarter of the width of a stuck rotor's limits: it keeps
#: the cost finite.
LEAST_DISTANCE = 0.25


class MarginTask(Task):
    r"""Redundant thrusts near the analytic centre of the limits; only with more than six rotors.

    .. math:: \min_z \sum_i -\ln(u_i - u_{i,min}) - \ln(u_{i,max} - u_i), \qquad u = u_{last} + N z,

    with N an orthonormal basis of the null space of the control effectiveness. The rows take, in every tick, the part
    :math:`\Delta t / T` of a Newton step. Without them smoothness alone holds these thrusts, and they wander.

    Source: Boyd and Vandenberghe, Convex Optimization, 2004, section 8.5.3 (analytic centre).
    """

    weight_settings = ("weights.margin",)

    def rows(self, model: Model) -> list[TaskRow]:
        """One row per redundant direction in newtons; none for six rotors."""
        if model.rotors <= WRENCH_SIZE:
            return []
        basis = np.linalg.qr(model.effectiveness.T, mode="complete")[0][:, WRENCH_SIZE:]
        directions = ca.DM(basis.T)
        target = directions @ model.last_thrust + self.step(model, basis)
        return [
            TaskRow(
                name=f"margin_{row}",
                unit="N",
                expression=directions[row, :] @ model.thrust,
                target=target[row],
                weight=model.weights.margin,
            )
            for row in range(basis.shape[1])
        ]

    def step(self, model: Model, basis: np.ndarray) -> ca.SX:
        """Change of the redundant thrusts in this tick [N], (rotors - 6,)."""
        low, high = model.thrust_limits
        above = ca.fmax(model.last_thrust - low, LEAST_DISTANCE)
        below = ca.fmax(high - model.last_thrust, LEAST_DISTANCE)
        columns = ca.DM(basis)
        curvature = columns.T @ ca.diag(above**-2 + below**-2) @ columns
        newton = ca.solve(curvature, columns.T @ (above**-1 - below**-1))
        return min(model.config.tick_s / SETTLING_TIME, 1.0) * newton
