"""A small simulator for the other examples: rigid body, first-order rotors, elastic wall with friction, seen edges.

It needs NumPy and SciPy only. Replace it by your own simulator, or by your vehicle.
"""

import math

import numpy as np
from scipy.spatial.transform import Rotation

from ibvs_qp import FeatureFrame, LineFeature, RgbdFrame, SensorFrame, VehicleParams, control_effectiveness
from ibvs_qp.frames import R_BODY_CAMERA

WALL_M = 0.85  # the wall is the plane x = 0.85 m of the world (north-east-down); the vehicle starts in the origin
STIFFNESS, DAMPING, FRICTION = 1500.0, 30.0, 0.3  # N/m, N s/m, Coulomb
GRAVITY = np.array([0.0, 0.0, 9.81])  # m/s^2
STEPS = 4  # of integration in a control tick
VIEW = (0.53, 0.40)  # half the picture, normalised: 640 x 480 px at a focal length of 600 px
SIGMA_RHO, SIGMA_THETA = 3e-4, 1e-3  # of a line: 0.2 px, 0.06 deg


class Vehicle:
    """Body axes front-right-down, and readings of the sensors; public attributes are SI units."""

    def __init__(self, params: VehicleParams) -> None:
        self.params, self.effectiveness = params, control_effectiveness(params.geometry)
        self.inertia = np.array(params.inertia_kg_m2)
        self.tip, self.camera = np.array(params.tip_position_m), np.array(params.camera_position_m)
        self.position, self.velocity, self.omega, self.turn = np.zeros(3), np.zeros(3), np.zeros(3), Rotation.identity()
        self.thrusts = np.full(params.geometry.count, GRAVITY[2] * params.mass_kg / -self.effectiveness[2].sum())
        self.specific_force, self.contact_force = -GRAVITY, np.zeros(3)  # in B

    @property
    def quaternion(self) -> np.ndarray:
        """Attitude (w, x, y, z)."""
        return np.roll(self.turn.as_quat(), 1)

    @property
    def tip_world(self) -> np.ndarray:
        """Brush tip in the world [m]."""
        return self.position + self.turn.apply(self.tip)

    @property
    def contact_wrench(self) -> np.ndarray:
        """Force and moment of the wall ON the vehicle about the centre of mass [N, N m], (6,)."""
        return np.concatenate((self.contact_force, np.cross(self.tip, self.contact_force)))

    @property
    def raw_wrench(self) -> np.ndarray:
        """Reading of the force/torque sensor: the vehicle's force on the tool, gravity included [N, N m], (6,)."""
        sensor, tool = np.array(self.params.force_torque_position_m), np.array(self.params.tool_position_m)
        load = self.params.tool_mass_kg * self.specific_force
        moment = np.cross(tool - sensor, load) - np.cross(self.tip - sensor, self.contact_force)
        return np.concatenate((load - self.contact_force, moment))

    def fly(self, command: np.ndarray, tick_s: float = 0.004) -> None:
        """Integrate one control tick; the thrusts follow the commanded ones [N], (n,), with a lag of 50 ms."""
        step = tick_s / STEPS
        for _ in range(STEPS):
            self.thrusts = self.thrusts + (command - self.thrusts) * step / 0.05
            speed = self.velocity + self.turn.apply(np.cross(self.omega, self.tip))
            depth = self.tip_world[0] - WALL_M
            normal = max(0.0, STIFFNESS * depth + DAMPING * speed[0]) if depth > 0.0 else 0.0
            sliding = speed * (0.0, 1.0, 1.0)
            rub = -FRICTION * normal * sliding / max(float(np.linalg.norm(sliding)), 0.005)
            self.contact_force = self.turn.inv().apply(rub - [normal, 0.0, 0.0])
            wrench = self.effectiveness @ self.thrusts + self.contact_wrench
            self.specific_force = wrench[:3] / self.params.mass_kg
            self.velocity = self.velocity + step * (self.turn.apply(self.specific_force) + GRAVITY)
            spin = (wrench[3:] - np.cross(self.omega, self.inertia * self.omega)) / self.inertia
            self.omega = self.omega + step * spin
            self.position = self.position + step * self.velocity
            self.turn = self.turn * Rotation.from_rotvec(step * self.omega)

    def sense(self, stamp_ns: int, image: RgbdFrame | None = None, features: FeatureFrame | None = None) -> SensorFrame:
        """Attitude, IMU and force sensor now, with a new picture or its features, if there is one."""
        return SensorFrame(
            stamp_ns=stamp_ns,
            attitude=self.quaternion,
            angular_velocity=self.omega,
            specific_force=self.specific_force,
            wrench=self.raw_wrench,
            wrench_stamp_ns=stamp_ns,
            image=image,
            features=features,
        )

    def in_camera(self, point: np.ndarray) -> np.ndarray:
        """Points of the world in camera axes (right, down, front) [m], (..., 3)."""
        return (self.turn.inv().apply(point - self.position) - self.camera) @ R_BODY_CAMERA

    def plane(self) -> tuple[float, float, float, float]:
        """The wall in camera axes, (A, B, C, -1) with A x + B y + C z = 1."""
        normal = R_BODY_CAMERA.T @ self.turn.inv().apply([1.0, 0.0, 0.0])
        a, b, c = normal / (normal @ self.in_camera(np.array([WALL_M, 0.0, 0.0])))
        return float(a), float(b), float(c), -1.0

    def edge(
        self, start: np.ndarray, end: np.ndarray, stamp_ns: int, track: int, kind: str = "board", side: int = 0
    ) -> LineFeature | None:
        """The part of an edge from one point of the world to another that the camera sees, or None.

        Args:
            start: Left or upper end [m], (3,).
            end: Right or lower end [m], (3,).
            stamp_ns: Time of the picture.
            track: Identity of the edge.
            kind: "board" or "paint".
            side: +1 if the surface lies below a level edge or to the right of an upright one, -1 if on the other side.
        """
        points = [point[:2] / point[2] for point in self.in_camera(np.linspace(start, end, 200)) if point[2] > 0.05]
        seen = [point for point in points if abs(point[0]) < VIEW[0] and abs(point[1]) < VIEW[1]]
        if len(seen) < 2 or math.dist(seen[0], seen[-1]) < 0.05:
            return None
        (x0, y0), (x1, y1) = seen[0], seen[-1]
        level = abs(x1 - x0) > abs(y1 - y0)
        theta = math.atan2(x1 - x0, y0 - y1) if level else math.atan2(x0 - x1, y1 - y0)
        return LineFeature(
            rho=x0 * math.cos(theta) + y0 * math.sin(theta),
            theta=theta,
            covariance=np.diag((SIGMA_RHO**2, SIGMA_THETA**2)),
            role="horizontal" if level else "vertical",
            stamp_ns=stamp_ns,
            track_id=track,
            segment=np.array((seen[0], seen[-1])),
            surface_side=side,
            kind=kind,
        )
