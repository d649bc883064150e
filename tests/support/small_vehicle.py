"""A rigid body with lagging rotors before a springy wall: just enough flight for the controller's own tests."""

from __future__ import annotations

import math

import numpy as np
from controller_scenes import TICK_NS, Wall
from scipy.spatial.transform import Rotation

from allocation import control_effectiveness
from ibvs_qp.config import ControllerConfig
from ibvs_qp.frames import cross
from ibvs_qp.measurement import HORIZONTAL, VERTICAL, Measurement

#: Height below the start and way to the right of the lines on the wall [m].
LEVEL_LINE, UPRIGHT_LINE = 0.05, -0.05


class SmallVehicle:
    """True state and what a perfect, undelayed set of sensors would say of it; the wall stands at x = `wall`."""

    def __init__(self, config: ControllerConfig, distance: float = 0.1, stiffness: float = 2000.0) -> None:
        self.vehicle, self.dt = config.vehicle, config.tick_s
        self.matrix = control_effectiveness(self.vehicle.geometry)
        self.mass, self.inertia = self.vehicle.mass_kg, self.vehicle.inertia
        self.tip = np.array(self.vehicle.tip_position_m)
        self.position, self.velocity, self.omega = np.zeros(3), np.zeros(3), np.zeros(3)
        self.attitude = Rotation.identity()
        self.wall, self.stiffness, self.friction = self.tip[0] + distance, stiffness, 0.3
        self.thrusts = np.linalg.pinv(self.matrix) @ [0, 0, -9.81 * self.mass, 0, 0, 0]
        self.specific_force, self.contact = np.array([0.0, 0.0, -9.81]), np.zeros(6)
        self.tick = 0

    @property
    def distance(self) -> float:
        """Tip to undeformed wall, < 0 while pressing [m]."""
        return float(self.wall - self.position[0] - self.attitude.apply(self.tip)[0])

    def measure(self, count: int = 2, **changes: object) -> Measurement:
        x, y, z, w = self.attitude.as_quat()
        quaternion = np.array([w, x, y, z])
        normal = self.attitude.inv().apply([1.0, 0.0, 0.0])
        along = self.distance / float(normal @ normal)
        wall = Wall(quaternion, along)
        foot = self.position + self.attitude.apply(wall.foot)
        features = (
            wall.line(LEVEL_LINE - foot[2], 0.5 * math.pi, HORIZONTAL),
            wall.line(UPRIGHT_LINE - foot[1], 0.0, VERTICAL),
        )
        stamp = (self.tick + 1) * TICK_NS
        fields: dict[str, object] = {
            "stamp_ns": stamp,
            "attitude": quaternion,
            "angular_velocity": self.omega.copy(),
            "specific_force": self.specific_force.copy(),
            "contact_wrench": self.contact.copy(),
            "wrench_stamp_ns": stamp,
            "plane": wall.plane,
            "plane_stamp_ns": stamp,
            "velocity": self.attitude.inv().apply(self.velocity),
            "lines": features[:count],
        }
        return Measurement(**(fields | changes))  # type: ignore[arg-type]

    def fly(self, command: np.ndarray, gust: np.ndarray | None = None) -> None:
        """One control tick in four steps: rotors follow with their lag, the wall pushes back, friction brakes."""
        step = self.dt / 4
        for _ in range(4):
            self.thrusts += (command - self.thrusts) * step / 0.05
            turn = self.attitude.as_matrix()
            speed = self.velocity + turn @ cross(self.omega, self.tip)
            distance = self.wall - self.position[0] - turn[0] @ self.tip
            press = max(0.0, -self.stiffness * distance + 15.0 * speed[0]) if distance < 0 else 0.0
            sliding = speed * [0.0, 1.0, 1.0]
            drag = -self.friction * press * sliding / max(float(np.linalg.norm(sliding)), 0.01)
            push = turn.T @ (np.array([-press, 0.0, 0.0]) + drag)
            self.contact = np.concatenate((push, cross(self.tip, push)))
            wrench = self.matrix @ self.thrusts + self.contact
            force = wrench[:3] + (turn.T @ gust if gust is not None else 0.0)
            self.specific_force = force / self.mass
            self.velocity = self.velocity + step * (turn @ self.specific_force + [0.0, 0.0, 9.81])
            spin = np.linalg.solve(self.inertia, wrench[3:] - cross(self.omega, self.inertia @ self.omega))
            self.omega = self.omega + step * spin
            self.position = self.position + step * self.velocity
            self.attitude = self.attitude * Rotation.from_rotvec(step * self.omega)
        self.tick += 1
