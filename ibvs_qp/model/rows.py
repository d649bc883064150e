"""Symbols of the program: thrusts, the body acceleration they cause, and named parameters that change every tick."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np

from allocation.effectiveness import control_effectiveness
from ibvs_qp.config import ControllerConfig
from ibvs_qp.config.errors import ConfigError


@dataclass(frozen=True, kw_only=True)
class TaskRow:
    """One least-squares row: weight * (expression(u) - target)^2 / 2, the expression affine in the thrusts."""

    name: str
    unit: str
    expression: ca.SX
    target: ca.SX
    weight: ca.SX


@dataclass(frozen=True, kw_only=True)
class LimitRow:
    """One two-sided row lower <= expression(u) <= upper; with a price it is soft: slack costs price * s^2 / 2."""

    name: str
    unit: str
    expression: ca.SX
    lower: ca.SX
    upper: ca.SX
    price: float | None = None


class SymbolicModel:
    r"""Thrusts u, the acceleration :math:`\dot\nu(u) = M^{-1}(B u + h)`, and the parameters of a tick.

    Rows are written in `thrust` and `acceleration`, both symbols; the assembly eliminates the acceleration.
    h gathers gravity, the gyroscopic moment, the contact feed-forward and the observed external wrench. Tasks and
    limits ask for parameters by name; asking twice gives the same symbol.
    """

    def __init__(self, config: ControllerConfig) -> None:
        self.config = config
        vehicle = config.vehicle
        self.effectiveness = control_effectiveness(vehicle.geometry)
        self.rotors = vehicle.geometry.count
        self.thrust = ca.SX.sym("thrust", self.rotors)
        self._parameters: dict[str, ca.SX] = {}
        self.acceleration = ca.SX.sym("acceleration", 6)
        self.wrench = ca.DM(vehicle.mass_matrix.diagonal()) * self.acceleration
        inverse_mass = np.linalg.inv(vehicle.mass_matrix)
        self.acceleration_per_thrust = ca.DM(inverse_mass @ self.effectiveness)
        self.free_acceleration = ca.DM(inverse_mass.diagonal()) * self.parameter("bias_wrench", 6)

    def parameter(self, name: str, size: int = 1) -> ca.SX:
        """The symbol of a named parameter, made at the first request; ConfigError when it has another size already."""
        if name not in self._parameters:
            self._parameters[name] = ca.SX.sym(name, size)
        symbol = self._parameters[name]
        if symbol.numel() != size:
            raise ConfigError(f"parameter {name!r} has {symbol.numel()} entries, {size} asked for")
        return symbol

    @property
    def parameters(self) -> dict[str, ca.SX]:
        """All parameters in the order of their first request."""
        return self._parameters

    @property
    def normal(self) -> ca.SX:
        """Unit vector into the wall, in B."""
        return self.parameter("normal", 3)

    @property
    def motion_acceleration(self) -> ca.SX:
        r"""S nu_dot with S = blockdiag(I - s n n^T, r I) and s = 1: the image never uses the pushing direction.

        The paper's profile takes s = lambda and r = 1.
        r is 1 in free flight and for a tip that shall stay, and falls in contact where the tip shall travel: held by
        friction it does not follow the body's turn, and a line row that counts on it trades vertical force for pitch.
        """
        linear = self.acceleration[:3]
        turn = self.parameter("turn_share") * self.acceleration[3:]
        along = self.parameter("normal_share") * ca.dot(self.normal, linear)
        return ca.vertcat(linear - self.normal * along, turn)
