"""What can be read of the plant at a control tick: truth, in NED and FRD."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ibvs_qp.vectors import Row, cross_product, turned, turned_back
from sim.clearance import PropellerClearance

if TYPE_CHECKING:
    from sim.model import ModelIds


class PlantReadings:
    """Pose, motion, forces and contact of a plant; arrays are the reader's own, plain numbers serve every tick."""

    _position: Row
    _quaternion: tuple[float, float, float, float]
    _rotation: tuple[Row, Row, Row]
    _world_velocity: Row
    _angular_velocity: Row
    _sensors: list[list[float]]
    _pushes: list[float]
    _act: np.ndarray
    _centre: np.ndarray
    _tip: np.ndarray
    _ids: ModelIds
    clearance: PropellerClearance

    @property
    def motion(self) -> tuple[float, ...]:
        """Position (3) and velocity (3) in the world [m, m/s], quaternion (4), rate in B (3) [rad/s]: 13 numbers."""
        return (*self._position, *self._world_velocity, *self._quaternion, *self._angular_velocity)

    @property
    def position(self) -> np.ndarray:
        """Body origin (assumed centre of mass), world NED [m], (3,)."""
        return np.array(self._position)

    @property
    def centre_of_mass(self) -> np.ndarray:
        """True centre of mass, world NED [m], (3,)."""
        return self.position + self.rotation @ self._centre

    @property
    def quaternion(self) -> np.ndarray:
        """Attitude (w, x, y, z) of B in I, (4,)."""
        return np.array(self._quaternion)

    @property
    def rotation(self) -> np.ndarray:
        """Rotation B to I, (3, 3)."""
        return np.array(self._rotation)

    @property
    def velocity(self) -> np.ndarray:
        """Velocity of the body origin in B [m/s], (3,)."""
        return np.array(turned_back(self._rotation, self._world_velocity))

    @property
    def angular_velocity(self) -> np.ndarray:
        """Angular velocity in B [rad/s], (3,)."""
        return np.array(self._angular_velocity)

    @property
    def euler(self) -> np.ndarray:
        """Roll, pitch, yaw [rad], (3,); yaw 0 faces the wall, + to the right."""
        (forward_x, _, _), (forward_y, _, _), (forward_z, right_z, down_z) = self._rotation
        pitch = math.asin(max(-1.0, min(1.0, -forward_z)))
        return np.array([math.atan2(right_z, down_z), pitch, math.atan2(forward_y, forward_x)])

    @property
    def tip(self) -> np.ndarray:
        """Undeformed tip, world NED [m], (3,); x > 0 is the penetration."""
        return self.position + self.rotation @ self._tip

    @property
    def tip_velocity(self) -> np.ndarray:
        """Velocity of the tip, world NED [m/s], (3,)."""
        return np.array(self._velocity_of(self._tip.tolist()))

    @property
    def thrusts_actual(self) -> np.ndarray:
        """Thrusts after the motor lag [N], (n,)."""
        return self._act.copy()

    @property
    def motor_thrusts(self) -> np.ndarray:
        """`thrusts_actual` as MuJoCo holds it: not to be kept nor written."""
        return self._act

    @property
    def specific_force(self) -> np.ndarray:
        """What a perfect accelerometer at the body origin reads, mean over the last tick, FRD [m/s^2], (3,)."""
        return np.array(self.felt)

    @property
    def felt(self) -> Row:
        """`specific_force` as plain numbers."""
        place = self._ids.accelerometer
        (ax, ay, az), (bx, by, bz), (cx, cy, cz), (dx, dy, dz) = [row[place] for row in self._sensors]
        share = 1.0 / len(self._sensors)
        return share * (ax + bx + cx + dx), -share * (ay + by + cy + dy), -share * (az + bz + cz + dz)

    @property
    def ft_wrench(self) -> np.ndarray:
        """Perfect force/torque sensor: vehicle on tool, at the sensor, FRD, at the last physics step [N, N m], (6,)."""
        last = self._sensors[-1]
        (fx, fy, fz), (mx, my, mz) = last[self._ids.force], last[self._ids.torque]
        return np.array((fx, -fy, -fz, mx, -my, -mz))

    @property
    def pushes(self) -> list[float]:
        """`contact_1khz` as plain numbers."""
        return self._pushes

    @property
    def contact_1khz(self) -> np.ndarray:
        """Normal contact force at the four physics steps of the last tick [N], (4,)."""
        return np.array(self._pushes)

    @property
    def contact_normal_force(self) -> float:
        """Normal contact force now [N], >= 0; pushing is positive."""
        return self._pushes[-1]

    @property
    def contact_friction(self) -> np.ndarray:
        """Force of the board on the tip along the board, world NED (y, z) [N], (2,)."""
        return np.array(self.friction)

    @property
    def friction(self) -> tuple[float, float]:
        """`contact_friction` as plain numbers."""
        found, _, first, second, *axes = self._sensors[-1][self._ids.contact]
        if found < 1.0:
            return 0.0, 0.0
        normal, tangent = axes[:3], axes[3:]
        (_, ty, tz), (_, sy, sz) = tangent, cross_product(normal, tangent)
        # Minus the force on the board, in NED: the two signs of y and z cancel.
        return first * ty + second * sy, first * tz + second * sz

    @property
    def propeller_clearance(self) -> float:
        """Smallest distance of any propeller disc to the board's face or, beside the board, to the wall [m]."""
        return self.clearance.distance(self.position, self.rotation)

    def _velocity_of(self, point: Sequence[float]) -> Row:
        """Velocity of a point of the body, world NED [m/s]."""
        (vx, vy, vz), (tx, ty, tz) = (
            self._world_velocity,
            turned(self._rotation, cross_product(self._angular_velocity, point)),
        )
        return vx + tx, vy + ty, vz + tz
