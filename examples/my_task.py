"""A task and a limit of one's own in the program, in one file; docs/extending.md explains it line by line.

The task keeps the propellers next to the brush slow while it presses, so that their wash does not reach wet paint. The
limit bounds how fast the vehicle may be accelerated upwards. The vehicle has eight rotors, so the slow ones cost no
force: the program finds that by itself.

Run it with ``python examples/my_task.py``.
"""

from types import SimpleNamespace

import casadi as ca
import numpy as np

from allocation import Rotor
from ibvs_qp import ControllerConfig, RotorGeometry, VehicleParams
from ibvs_qp.limits import Limit, ThrustLimit
from ibvs_qp.qp.acceptance import QpEngine
from ibvs_qp.qp.assembly import QpTemplate
from ibvs_qp.qp.model import LimitRow, TaskRow
from ibvs_qp.qp.model import SymbolicModel as Model
from ibvs_qp.tasks import EffortTask, LevelTask, PushTask, SmoothnessTask, Task, VelocityTask, YawTask


class QuietRotors(Task):
    """Named rotors stay near a low thrust [N] while the brush presses."""

    def __init__(self, names: tuple[str, ...], thrust_n: float, weight: float = 0.1) -> None:
        # 0.1 = 1 / (3 N)^2: three newtons more are worth as much as half a newton of push. It gives way.
        self.names, self.thrust_n, self.weight = names, thrust_n, weight

    def rows(self, model: Model) -> list[TaskRow]:
        """One row per named rotor in newtons."""
        quiet, order = model.parameter("quiet", 2), model.config.vehicle.geometry.names
        return [
            TaskRow(
                name=f"quiet_{name}",
                unit="N",
                expression=model.thrust[order.index(name)],
                target=quiet[0],
                weight=quiet[1],
            )
            for name in self.names
        ]

    def pack(self, values, terms) -> None:
        """Asked only in contact: elsewhere the weight is zero and the row stays."""
        values["quiet"][:] = self.thrust_n, self.weight if terms.contact.in_contact else 0.0


class ClimbLimit(Limit):
    """Upward acceleration stays below a bound [m/s^2]; soft, so that it can never make the program infeasible."""

    def __init__(self, bound: float, price: float = 1000.0) -> None:
        self.bound, self.price = bound, price

    def rows(self, model: Model) -> list[LimitRow]:
        """One soft row in m/s^2; body z points down."""
        return [
            LimitRow(
                name="climb",
                unit="m/s^2",
                expression=-model.acceleration[2],
                lower=ca.SX(-1e3),  # a finite bound that never binds: row types must not change
                upper=ca.SX(self.bound),
                price=self.price,
            )
        ]


OCTOROTOR = RotorGeometry(
    rotors=tuple(Rotor(name=f"r{i}", azimuth_deg=22.5 + 45.0 * i, spin=1 - 2 * (i % 2)) for i in range(8)),
    circle_radius_m=0.46,
    tilt_deg=30.0,
    torque_ratio_m=0.020,
)
CONFIG = ControllerConfig(vehicle=VehicleParams(geometry=OCTOROTOR, thrust_max_n=35.0, propeller_radius_m=0.165))


def program(tasks: list[Task], limits: list[Limit]) -> QpEngine:
    """The controller's tasks without lines, and more; a hover that shall push with 5 N and climb with 2 m/s^2."""
    shipped: list[Task] = [PushTask(), LevelTask(), YawTask(), VelocityTask(), EffortTask(), SmoothnessTask()]
    engine = QpEngine(QpTemplate(Model(CONFIG), shipped + tasks, [ThrustLimit(), *limits]), CONFIG.solver)
    values, weights, weight = engine.data.parameters, CONFIG.weights, 9.81 * CONFIG.vehicle.mass_kg
    values["bias_wrench"][:] = 0.0, 0.0, weight, 0.0, 0.0, 0.0  # what acts beside the rotors
    values["normal"][:], values["axis_right"][:], values["axis_down"][:] = np.eye(3)
    values["push"][:] = 5.0, weights.push
    values["level"][:] = 0.0, 0.0, weights.level
    values["yaw"][:] = 0.0, weights.yaw
    values["velocity_right"][:], values["velocity_down"][:] = (0.0, weights.velocity), (-2.0, weights.velocity)
    values["last_thrust"][:] = values["extrapolated_thrust"][:] = 8.5
    values["thrust_lower"][:], values["thrust_upper"][:] = CONFIG.vehicle.thrust_min, CONFIG.vehicle.thrust_max
    in_contact = SimpleNamespace(contact=SimpleNamespace(in_contact=True))
    for part in (*tasks, *limits):
        part.pack(values, in_contact)  # type: ignore[arg-type]
    return engine


def main() -> None:
    """Solve the same wish three times: as shipped, with the task, with task and limit."""
    quiet, climb = QuietRotors(("r0", "r7"), thrust_n=4.0), ClimbLimit(bound=0.5)
    cases: list[tuple[str, list[Task], list[Limit]]] = [
        ("as shipped", [], []),
        ("quiet rotors", [quiet], []),
        ("and limit", [quiet], [climb]),
    ]
    for words, tasks, limits in cases:
        engine = program(tasks, limits)
        for _ in range(5):  # a few ticks: every one starts from the last solution
            solution = engine.solve()
        assert solution is not None
        u, names = solution.thrusts, engine.template.row_names
        wrench = engine.template.model.effectiveness @ u
        price = dict(zip(names, solution.y.tolist(), strict=True)).get("climb", 0.0)
        print(
            f"{words:12s}  front rotors {u[0]:5.2f} {u[7]:5.2f} N  push {wrench[0]:5.2f} N  "
            f"climb {-wrench[2] / CONFIG.vehicle.mass_kg - 9.81:4.2f} m/s^2  price {price:5.1f}  {solution.outcome}"
        )


if __name__ == "__main__":
    main()
