"""The truth: vehicle, air and contact, advanced one control tick at a time; NED and FRD on every face."""

# MuJoCo's bindings carry no types.
# pyright: reportAttributeAccessIssue=false
from __future__ import annotations

import math

import mujoco
import numpy as np

from ibvs_qp.frames import cross, rotation_from_quaternion, skew
from ibvs_qp.vehicle import VehicleParams
from sim.board import BoardGeometry
from sim.clearance import PropellerClearance
from sim.crash import crash_reason
from sim.model import build_model
from sim.mujoco_frames import FLIP, FLIP_QUATERNION
from sim.scene import Scene
from sim.streams import stream
from sim.trim import hover_thrusts, start_pose, true_limits
from sim.wind import Wind

#: Physics steps of 1 ms in one control tick, and the tick in nanoseconds.
STEPS_PER_TICK = 4
TICK_NS = 4_000_000

#: End of a flight whose controller commands something that is no number; physics stands still from then on.
NOT_FINITE = "non-finite thrust command"


class Plant:
    """The simulated vehicle in its scene.

    The body frame has its origin at the ASSUMED centre of mass (positions of `VehicleParams`); the true one lies
    ``scene.vehicle.com_offset_m`` away. Starts level and at rest with the rotors at hover, at the scene's start pose
    varied by the seed. Same scene, seed and thrusts: same bits.

    Attributes:
        time_ns: Simulated time since the start [ns].
        crashed: Why the flight is over (propeller strike, ground, flip, non-finite state), or None.
        wind: The air; its mean may be changed in flight.
        contact_1khz: Normal contact force at the four physics steps of the last tick [N], (4,).

    Args:
        scene: The truth.
        vehicle: Geometry and nominal parameters.
        seed: Varies start pose and gusts.
    """

    def __init__(self, scene: Scene, vehicle: VehicleParams | None = None, seed: int = 0) -> None:
        self.scene, self.vehicle = scene, vehicle or VehicleParams()
        self.model, self._ids = build_model(scene, self.vehicle)
        self.data = mujoco.MjData(self.model)
        self._lower, self._upper = true_limits(scene, self.vehicle)
        self._lags = scene.vehicle.motor_lag_up_s, scene.vehicle.motor_lag_down_s
        self._centre, self._tip = np.array(scene.vehicle.com_offset_m), np.array(self.vehicle.tip_position_m)
        self._skew_centre, self._skew_tip = skew(self._centre), skew(self._tip)
        self._clearance = PropellerClearance(BoardGeometry(scene), self.vehicle)
        drag = self.vehicle.linear_drag_n_s_m
        self.wind = Wind(scene.wind, drag, TICK_NS * 1e-9, stream(seed, "wind"))
        # Moment arm from the bare vehicle's centre of mass, where MuJoCo applies forces, to the whole one's.
        self._skew_drag_arm = skew(self._centre - FLIP * self.model.body_ipos[self._ids.vehicle])
        self._state = self.data.qpos, self.data.qvel, self.data.act  # views; fetching them each time costs more
        self._sensordata, self._applied = self.data.sensordata, self.data.xfrc_applied[self._ids.vehicle]
        self.time_ns = 0
        self.crashed: str | None = None
        self.contact_1khz = np.zeros(STEPS_PER_TICK)
        self._sensors = np.zeros((STEPS_PER_TICK, self.model.nsensordata))
        self._start(*start_pose(scene, self.vehicle, seed), hover_thrusts(scene, self.vehicle))

    def _start(self, position: np.ndarray, yaw: float, thrusts: np.ndarray) -> None:
        self.data.qpos[:3] = FLIP * position
        self.data.qpos[3:7] = FLIP_QUATERNION * (math.cos(0.5 * yaw), 0.0, 0.0, math.sin(0.5 * yaw))
        self.data.act[:] = self.data.ctrl[:] = thrusts
        mujoco.mj_forward(self.model, self.data)
        self._sensors[:] = self.data.sensordata
        self._refresh()

    def _refresh(self) -> None:
        """Convert the state once per tick."""
        qpos, qvel, _ = self._state
        self._position = FLIP * qpos[:3]
        self._quaternion = FLIP_QUATERNION * qpos[3:7]
        self._rotation = rotation_from_quaternion(self._quaternion)
        self._world_velocity = FLIP * qvel[:3]
        self._angular_velocity = FLIP * qvel[3:]

    def step(self, thrusts: np.ndarray) -> None:
        """Advance one control tick of 4 ms under constant commanded thrusts.

        Args:
            thrusts: Commanded thrusts [N], (n,); clipped to the true limits. One that is no number ends the flight.
        """
        if self.crashed == NOT_FINITE or not np.isfinite(thrusts).all():
            self.crashed, self.time_ns = self.crashed or NOT_FINITE, self.time_ns + TICK_NS
            return
        model, data, sensors, sensordata = self.model, self.data, self._sensors, self._sensordata
        command = np.minimum(np.maximum(thrusts, self._lower), self._upper)
        data.ctrl[:] = command
        # Under a constant command a first-order lag never crosses it, so one choice holds for the tick.
        model.actuator_dynprm[:, 0] = np.where(command >= self._state[2], *self._lags)
        self._apply_air()
        for k in range(STEPS_PER_TICK):
            mujoco.mj_step(model, data)
            sensors[k] = sensordata
        self.time_ns += TICK_NS
        contact = sensors[:, self._ids.contact]
        self.contact_1khz = np.where(contact[:, 0] > 0.0, contact[:, 1], 0.0)
        self._refresh()
        self.crashed = self.crashed or crash_reason(self._position, self._rotation, self._clearance)

    def _apply_air(self) -> None:
        rotation = self._rotation
        velocity = self._world_velocity - rotation @ (self._skew_centre @ self._angular_velocity)
        force = self.wind.force(velocity)
        self._applied[:3] = FLIP * force
        self._applied[3:] = FLIP * (rotation @ (self._skew_drag_arm @ (force @ rotation)))

    @property
    def thrust_limits(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper limits of the real rotors now [N], (n,) each; a fault may set new ones."""
        return self._lower, self._upper

    @thrust_limits.setter
    def thrust_limits(self, limits: tuple[np.ndarray, np.ndarray]) -> None:
        self._lower, self._upper = (np.array(limit, float) for limit in limits)

    @property
    def position(self) -> np.ndarray:
        """Body origin (assumed centre of mass), world NED [m], (3,)."""
        return self._position

    @property
    def centre_of_mass(self) -> np.ndarray:
        """True centre of mass, world NED [m], (3,)."""
        return self._position + self._rotation @ self._centre

    @property
    def quaternion(self) -> np.ndarray:
        """Attitude (w, x, y, z) of B in I, (4,)."""
        return self._quaternion

    @property
    def rotation(self) -> np.ndarray:
        """Rotation B to I, (3, 3)."""
        return self._rotation

    @property
    def velocity(self) -> np.ndarray:
        """Velocity of the body origin in B [m/s], (3,)."""
        return self._rotation.T @ self._world_velocity

    @property
    def angular_velocity(self) -> np.ndarray:
        """Angular velocity in B [rad/s], (3,)."""
        return self._angular_velocity

    @property
    def euler(self) -> np.ndarray:
        """Roll, pitch, yaw [rad], (3,); yaw 0 faces the wall, + to the right."""
        r = self._rotation
        pitch = math.asin(max(-1.0, min(1.0, -r[2, 0])))
        return np.array([math.atan2(r[2, 1], r[2, 2]), pitch, math.atan2(r[1, 0], r[0, 0])])

    @property
    def tip(self) -> np.ndarray:
        """Undeformed tip, world NED [m], (3,); x > 0 is the penetration."""
        return self._position + self._rotation @ self._tip

    @property
    def tip_velocity(self) -> np.ndarray:
        """Velocity of the tip, world NED [m/s], (3,)."""
        return self._world_velocity - self._rotation @ (self._skew_tip @ self._angular_velocity)

    @property
    def thrusts_actual(self) -> np.ndarray:
        """Thrusts after the motor lag [N], (n,)."""
        return self._state[2].copy()

    @property
    def specific_force(self) -> np.ndarray:
        """What a perfect accelerometer at the body origin reads, mean over the last tick, FRD [m/s^2], (3,)."""
        return FLIP * self._sensors[:, self._ids.accelerometer].mean(axis=0)

    @property
    def ft_wrench(self) -> np.ndarray:
        """Perfect force/torque sensor: vehicle on tool, at the sensor, FRD, at the last physics step [N, N m], (6,)."""
        last = self._sensors[-1]
        return np.concatenate((FLIP * last[self._ids.force], FLIP * last[self._ids.torque]))

    @property
    def contact_normal_force(self) -> float:
        """Normal contact force now [N], >= 0; pushing is positive."""
        return float(self.contact_1khz[-1])

    @property
    def contact_friction(self) -> np.ndarray:
        """Force of the board on the tip along the board, world NED (y, z) [N], (2,)."""
        found_force_normal_tangent = self._sensors[-1, self._ids.contact]
        if found_force_normal_tangent[0] < 1.0:
            return np.zeros(2)
        force = found_force_normal_tangent[1:4]
        normal, tangent = found_force_normal_tangent[4:7], found_force_normal_tangent[7:10]
        on_board = force[1] * tangent + force[2] * cross(normal, tangent)
        return -(FLIP * on_board)[1:]

    @property
    def propeller_clearance(self) -> float:
        """Smallest distance of any propeller disc to the board's face or, beside the board, to the wall [m]."""
        return self._clearance.distance(self._position, self._rotation)
