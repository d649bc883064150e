"""A task of your own: slow the propellers beside the brush, so that their wash does not reach wet paint.

The vehicle has eight rotors: to keep the moment zero r3 and r4, opposite, slow down as well; four replace the force.
"""

import numpy as np

from allocation import Rotor
from ibvs_qp import ControllerConfig, HybridController, Measurement, Reference, RotorGeometry, VehicleParams
from ibvs_qp.model.model import Model
from ibvs_qp.model.rows import Parameter, TaskRow
from ibvs_qp.tasks import Task


class QuietRotors(Task):
    """Thrusts of named rotors stay near a target."""

    def __init__(self, *names: str, weight: float = 0.1) -> None:
        self.names = names
        self._thrust, self._weight = Parameter("quiet_thrust", 0.0), Parameter("quiet_weight", weight)

    def set_target(self, thrust_n: float, weight: float | None = None) -> None:
        """Target thrust [N] from the next step on, and its weight [1/N^2]; weight 0 makes the task absent."""
        self._thrust.value[:] = thrust_n
        if weight is not None:
            self._weight.value[:] = weight

    def rows(self, model: Model) -> list[TaskRow]:
        """One row per named rotor in newtons."""
        target, weight = model.parameter(self._thrust), model.parameter(self._weight)
        order = model.config.vehicle.geometry.names
        return [
            TaskRow(
                name=f"quiet_{name}", unit="N", expression=model.thrust[order.index(name)], target=target, weight=weight
            )
            for name in self.names
        ]


OCTOROTOR = RotorGeometry(
    rotors=tuple(Rotor(name=f"r{i}", azimuth_deg=22.5 + 45.0 * i, spin=1 - 2 * (i % 2)) for i in range(8)),
    circle_radius_m=0.46,
    tilt_deg=30.0,
    torque_ratio_m=0.020,
)
CONFIG = ControllerConfig(vehicle=VehicleParams(geometry=OCTOROTOR, thrust_max_n=35.0, propeller_radius_m=0.165))
#: Hover 0.8 m in front of a wall.
HOVER = Measurement(
    stamp_ns=4_000_000,
    attitude=np.array([1.0, 0.0, 0.0, 0.0]),
    angular_velocity=np.zeros(3),
    specific_force=np.array([0.0, 0.0, -9.81]),
    contact_wrench=np.zeros(6),
    wrench_stamp_ns=4_000_000,
    plane=(0.0, 0.0, 1.25, -1.0),
    plane_stamp_ns=4_000_000,
    velocity=np.zeros(3),
)

quiet = QuietRotors("r0", "r7")
for words, tasks in (("as shipped", []), ("quiet rotors", [quiet])):
    controller = HybridController(CONFIG, tasks=tasks)
    if tasks:
        quiet.set_target(4.0)  # at the default weight of 1 / (3 N)^2: 3 N of error cost as much as 1.3 N of push
    command = controller.step(HOVER, Reference(standoff=0.3))
    print(f"{words:12s}  thrusts {np.round(command.thrusts, 1).tolist()} N, {command.outcome}")
