"""HybridController on a user's own vehicle: press an elastic wall with 5 N and slide along an edge drawn on it.

The vehicle needs numpy and scipy only: a rigid body with first-order rotors, a wall with stiffness, damping and
friction, and an edge projected into the camera. Replace `Vehicle` by your own vehicle or simulator.

Run it with ``python examples/plain_python.py``.
"""

import math

import numpy as np
from scipy.spatial.transform import Rotation

from ibvs_qp import (
    ControllerConfig,
    HybridController,
    LineFeature,
    LineReference,
    Measurement,
    Reference,
    control_effectiveness,
)
from ibvs_qp.frames import R_BODY_CAMERA

PUSH, SLIDE, SECONDS = 5.0, -0.05, 12.0  # N; m/s to the right, so to the left; s
WALL, EDGE = 0.85, 0.05  # the wall is the plane x = 0.85 m, the edge lies 5 cm below the start height (world NED)
GRAVITY_WORLD = np.array([0.0, 0.0, 9.81])  # m/s^2
STIFFNESS, DAMPING, FRICTION = 1500.0, 30.0, 0.3  # N/m, N s/m, Coulomb


class Vehicle:
    """Rigid body in world NED, body front-right-down, and its sensors."""

    def __init__(self, config: ControllerConfig) -> None:
        self.params, self.dt = config.vehicle, config.tick_s
        self.b_matrix = control_effectiveness(self.params.geometry)
        self.inertia, self.tip = np.array(self.params.inertia_kg_m2), np.array(self.params.tip_position_m)
        self.camera = np.array(self.params.camera_position_m)
        self.position, self.velocity, self.omega, self.turn = np.zeros(3), np.zeros(3), np.zeros(3), Rotation.identity()
        self.thrusts = np.full(len(self.b_matrix.T), 9.81 * self.params.mass_kg / -self.b_matrix[2].sum())
        self.specific_force, self.contact, self.time_ns = np.array([0.0, 0.0, -9.81]), np.zeros(6), 0

    @property
    def tip_world(self) -> np.ndarray:
        """Brush tip in world NED."""
        return self.position + self.turn.apply(self.tip)

    def fly(self, command: np.ndarray) -> None:
        """Integrate one control tick in four steps; rotor thrusts follow the commanded ones [N], (n,)."""
        for _ in range(4):
            step = self.dt / 4
            self.thrusts = self.thrusts + (command - self.thrusts) * step / 0.05
            speed = self.velocity + self.turn.apply(np.cross(self.omega, self.tip))
            depth = self.tip_world[0] - WALL
            normal = max(0.0, STIFFNESS * depth + DAMPING * speed[0]) if depth > 0.0 else 0.0
            sliding = np.array([0.0, speed[1], speed[2]])
            rub = -FRICTION * normal * sliding / max(float(np.linalg.norm(sliding)), 0.005)
            force = self.turn.inv().apply(rub - [normal, 0.0, 0.0])
            self.contact = np.concatenate((force, np.cross(self.tip, force)))
            wrench = self.b_matrix @ self.thrusts + self.contact
            self.specific_force = wrench[:3] / self.params.mass_kg
            self.velocity = self.velocity + step * (self.turn.apply(self.specific_force) + GRAVITY_WORLD)
            spin = wrench[3:] - np.cross(self.omega, self.inertia * self.omega)
            self.omega = self.omega + step * spin / self.inertia
            self.position = self.position + step * self.velocity
            self.turn = self.turn * Rotation.from_rotvec(step * self.omega)
        self.time_ns += round(self.dt * 1e9)

    def in_camera(self, point: np.ndarray) -> np.ndarray:
        """Point in world NED to camera axes (right, down, front) [m], (3,)."""
        return R_BODY_CAMERA.T @ (self.turn.inv().apply(point - self.position) - self.camera)

    def measure(self) -> Measurement:
        """Attitude, IMU, contact wrench, edge line, wall plane and velocity at the present time."""
        x, y, z, w = self.turn.as_quat()
        normal = R_BODY_CAMERA.T @ self.turn.inv().apply([1.0, 0.0, 0.0])
        middle = np.array([WALL, self.tip_world[1], EDGE])
        distance = float(normal @ self.in_camera(middle))
        left, right = (self.in_camera(middle + np.array([0.0, side, 0.0])) for side in (-0.2, 0.2))
        a, b, c = np.cross(left / left[2], right / right[2])  # the image line a x + b y + c = 0
        line = LineFeature(
            rho=-c / math.hypot(a, b),
            theta=math.atan2(b, a),
            covariance=1e-6 * np.eye(2),
            role="horizontal",
            stamp_ns=self.time_ns,
        )
        return Measurement(
            stamp_ns=self.time_ns,
            attitude=np.array([w, x, y, z]),
            angular_velocity=self.omega,
            specific_force=self.specific_force,
            contact_wrench=self.contact,
            wrench_stamp_ns=self.time_ns,
            lines=(line,),
            plane=(*(normal / distance).tolist(), -1.0),
            plane_stamp_ns=self.time_ns,
            velocity=self.turn.inv().apply(self.velocity),
        )


def main() -> None:
    """Approach, press, slide; print once per second."""
    controller = HybridController()
    vehicle = Vehicle(controller.config)
    below_tip = float(vehicle.camera[2])
    for tick in range(round(SECONDS / vehicle.dt)):
        measurement = vehicle.measure()
        depth = 1.0 / measurement.plane[2]  # of the wall along the optical axis
        reference = Reference(
            push_force=PUSH,
            contact=True,
            # Target of the line: EDGE below the tip, in normalised image coordinates.
            lines=(LineReference(rho=(EDGE - below_tip) / depth, theta=0.5 * math.pi, role="horizontal"),),
            velocity=np.array([SLIDE if tick * vehicle.dt > 5.0 else 0.0, 0.0]),
        )
        command = controller.step(measurement, reference)
        vehicle.fly(command.thrusts)
        if (tick + 1) % 250 == 0:
            height_mm, along = 1e3 * vehicle.tip_world[2], vehicle.tip_world[1]
            print(
                f"{(tick + 1) * vehicle.dt:5.1f} s  {command.mode:8s}  push {-vehicle.contact[0]:5.2f} N  "
                f"height error {height_mm:+5.1f} mm  slid {along:+6.3f} m  {command.outcome}"
            )


if __name__ == "__main__":
    main()
