"""A limit of your own: the upward acceleration stays below a bound, and the command states the cost.

The limit is soft: its slack lets the climb exceed the bound of 0.5 m/s^2 by a little, here 0.04 m/s^2.
"""

import casadi as ca
import numpy as np

from ibvs_qp import ControllerConfig, HybridController, Measurement, Reference
from ibvs_qp.limits import Limit
from ibvs_qp.model.model import Model
from ibvs_qp.model.rows import LimitRow


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

CONFIG = ControllerConfig()
CLIMB = Reference(standoff=0.3, velocity=np.array([0.0, -1.0]))  # at 1 m/s
for words, limits in (("as shipped", []), ("with the limit", [ClimbLimit(bound=0.5)])):
    controller = HybridController(CONFIG, limits=limits)
    command = controller.step(HOVER, CLIMB)
    up = -command.wrench[2] / CONFIG.vehicle.mass_kg - 9.81
    price = sum(limit.price for limit in command.active_limits if limit.name == "climb")
    print(f"{words:14s}  climb {up:4.2f} m/s^2, price of the limit {price:5.1f}, {command.outcome}")
