"""Readings of the plant at a control tick: truth, in NED and FRD."""

from __future__ import annotations

import math

import numpy as np

from sim.world.board import BoardGeometry
from sim.world.clearance import PropellerClearance
from sim.world.readout import MOTION, PLACES
from sim.world.scene import Scene
from sim.world.true_vehicle import TrueVehicle

_PUSH, _TIP, _FRICTION = PLACES["push"].start, PLACES["tip"], PLACES["friction"]


def _reading(name: str, text: str) -> property:
    """A property that returns a copy of one reading."""
    place = PLACES[name]
    return property(lambda plant: plant.truth[place].copy(), doc=text)


class PlantReadings:
    """Pose, motion, forces and contact of a plant, each a copy."""

    scene: Scene
    truth: np.ndarray
    pushes: np.ndarray
    vehicle: TrueVehicle
    clearance: PropellerClearance
    _act: np.ndarray
    _board: BoardGeometry

    position = _reading("position", "Body origin (assumed centre of mass), world NED [m], (3,).")
    quaternion = _reading("quaternion", "Attitude (w, x, y, z) of B in I, (4,).")
    velocity = _reading("body_velocity", "Velocity of the body origin in B [m/s], (3,).")
    angular_velocity = _reading("rate", "Angular velocity in B [rad/s], (3,).")
    tip = _reading("tip", "Undeformed tip in the wall's chart [m], (3,); x > 0 is the penetration.")
    specific_force = _reading(
        "felt", "Reading of a perfect accelerometer at the body origin, mean over the last tick, FRD [m/s^2], (3,)."
    )
    ft_wrench = _reading(
        "ft_wrench",
        "Perfect force/torque sensor: vehicle on tool, in its place and axes, last physics step [N, N m], (6,).",
    )

    @property
    def contact_friction(self) -> np.ndarray:
        """Force of the board on the tip along it (right, down) [N], (2,)."""
        return self.truth[_FRICTION][1:].copy()

    @property
    def motion(self) -> np.ndarray:
        """Position (3) and velocity (3) in the world [m, m/s], quaternion (4), rate in B (3) [rad/s], (13,)."""
        return self.truth[MOTION].copy()

    @property
    def rotation(self) -> np.ndarray:
        """Rotation B to I, (3, 3)."""
        return self.truth[PLACES["rotation"]].reshape(3, 3).copy()

    @property
    def euler(self) -> np.ndarray:
        """Roll, pitch, yaw [rad], (3,); yaw 0 faces the wall in the middle of the board, + to the right."""
        ned = self._board.from_ned.T @ self.rotation
        (forward_x, _, _), (forward_y, _, _), (forward_z, right_z, down_z) = ned.tolist()
        pitch = math.asin(max(-1.0, min(1.0, -forward_z)))
        return np.array([math.atan2(right_z, down_z), pitch, math.atan2(forward_y, forward_x)])

    @property
    def tip_on_wall(self) -> tuple[float, float]:
        """Chart (y, z) of the tip [m] as plain numbers."""
        _, y, z = self.truth[_TIP].tolist()
        return y, z

    @property
    def thrusts_actual(self) -> np.ndarray:
        """Thrusts after the motor lag [N], (n,)."""
        return self._act.copy()

    @property
    def motor_thrusts(self) -> np.ndarray:
        """`thrusts_actual` in MuJoCo's own array: a view, read-only."""
        return self._act

    @property
    def contact_normal_force(self) -> float:
        """Normal contact force now [N], >= 0; pushing is positive."""
        return self.truth.item(_PUSH)

    @property
    def propeller_clearance(self) -> float:
        """Smallest distance of any propeller disc to the board's face or, beside the board, to the wall [m]."""
        return self.clearance.distance(self.position, self.rotation)
