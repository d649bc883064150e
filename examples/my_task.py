"""A user's own task and limit in the controller; docs/extending.md explains both.

The task slows the propellers next to the brush, so that their wash does not reach wet paint. The limit bounds the
upward acceleration. The vehicle has eight rotors: the other six replace the force of the slow ones.

Run it with ``python examples/my_task.py``.
"""

import casadi as ca
import numpy as np

from allocation import Rotor
from ibvs_qp import ControllerConfig, HybridController, Measurement, Reference, RotorGeometry, VehicleParams
from ibvs_qp.limits import Limit
from ibvs_qp.model.model import Model
from ibvs_qp.model.parameter import Parameter
from ibvs_qp.model.rows import LimitRow, TaskRow
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


class ClimbLimit(Limit):
    """Upward acceleration stays below a bound [m/s^2]; soft, so that the QP always has a solution."""

    def __init__(self, bound: float, weight: float = 4e4) -> None:
        self.bound, self.weight = bound, weight

    def rows(self, model: Model) -> list[LimitRow]:
        """One soft row in m/s^2; body z points down."""
        return [
            LimitRow(
                name="climb",
                unit="m/s^2",
                expression=-model.acceleration[2],
                lower=ca.SX(-1e3),  # finite and never reached, so that the row type is constant
                upper=ca.SX(self.bound),
                slack_weight=self.weight,
            )
        ]


OCTOROTOR = RotorGeometry(
    rotors=tuple(Rotor(name=f"r{i}", azimuth_deg=22.5 + 45.0 * i, spin=1 - 2 * (i % 2)) for i in range(8)),
    circle_radius_m=0.46,
    tilt_deg=30.0,
    torque_ratio_m=0.020,
)
CONFIG = ControllerConfig(vehicle=VehicleParams(geometry=OCTOROTOR, thrust_max_n=35.0, propeller_radius_m=0.165))
#: Hover 0.8 m in front of a wall; the reference is a climb at 1 m/s.
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
RISE = Reference(standoff=0.3, velocity=np.array([0.0, -1.0]))


def main() -> None:
    """Solve the same measurement three times: as shipped, with the task, with task and limit."""
    quiet, climb = QuietRotors("r0", "r7"), ClimbLimit(bound=0.5)
    cases: list[tuple[str, list[Task], list[Limit]]] = [
        ("as shipped", [], []),
        ("quiet rotors", [quiet], []),
        ("and limit", [quiet], [climb]),
    ]
    for words, tasks, limits in cases:
        controller = HybridController(CONFIG, tasks=tasks, limits=limits)
        if tasks:
            # 4 N at the default weight of 1 / (3 N)^2: an error of 3 N costs as much as 1.3 N of push.
            quiet.set_target(4.0)
        command = controller.step(HOVER, RISE)
        up = -command.wrench[2] / CONFIG.vehicle.mass_kg - 9.81
        price = sum(limit.price for limit in command.active_limits if limit.name == "climb")
        print(
            f"{words:12s}  front rotors {command.thrusts[0]:5.2f} {command.thrusts[7]:5.2f} N  "
            f"climb {up:4.2f} m/s^2  price of the limit {price:5.1f}"
        )


if __name__ == "__main__":
    main()
