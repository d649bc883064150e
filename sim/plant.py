"""The truth: vehicle, air and contact, advanced one control tick at a time; NED and FRD on every face."""

# MuJoCo's bindings carry no types.
# pyright: reportAttributeAccessIssue=false
from __future__ import annotations

import math

import mujoco
import numpy as np

from ibvs_qp.vectors import cross_product, rotation_rows, turned, turned_back
from ibvs_qp.vehicle import VehicleParams
from sim.board import BoardGeometry
from sim.clearance import PropellerClearance
from sim.crash import crash_reason
from sim.model import build_model
from sim.mujoco_frames import FLIP, FLIP_QUATERNION
from sim.readings import PlantReadings
from sim.scene import Scene
from sim.streams import stream
from sim.trim import hover_thrusts, start_pose, true_limits
from sim.wind import Wind

#: Physics steps of 1 ms in one control tick, and the tick in nanoseconds.
STEPS_PER_TICK = 4
TICK_NS = 4_000_000

#: End of a flight whose controller commands something that is no number; physics stands still from then on.
NOT_FINITE = "non-finite thrust command"


class Plant(PlantReadings):
    """The simulated vehicle in its scene.

    The body frame has its origin at the ASSUMED centre of mass (positions of `VehicleParams`); the true one lies
    ``scene.vehicle.com_offset_m`` away. Starts level and at rest with the rotors at hover, at the scene's start pose
    varied by the seed. Same scene, seed and thrusts: same bits.

    Attributes:
        time_ns: Simulated time since the start [ns].
        crashed: Why the flight is over (propeller strike, ground, flip, non-finite state), or None.
        wind: The air; its mean may be changed in flight.

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
        self._centre_list = self._centre.tolist()
        self.clearance = PropellerClearance(BoardGeometry(scene), self.vehicle)
        drag = self.vehicle.linear_drag_n_s_m
        self.wind = Wind(scene.wind, drag, TICK_NS * 1e-9, stream(seed, "wind"))
        # Moment arm from the bare vehicle's centre of mass, where MuJoCo applies forces, to the whole one's.
        self._drag_arm = (self._centre - FLIP * self.model.body_ipos[self._ids.vehicle]).tolist()
        # Views: fetching them from MuJoCo each time costs more than reading them.
        self._qpos, self._qvel, self._act = self.data.qpos, self.data.qvel, self.data.act
        self._ctrl, self._lag = self.data.ctrl, self.model.actuator_dynprm[:, 0]
        self._sensordata, self._applied = self.data.sensordata, self.data.xfrc_applied[self._ids.vehicle]
        self._rising = np.zeros(self.model.nu, dtype=bool)
        self.time_ns = 0
        self.crashed: str | None = None
        self._start(*start_pose(scene, self.vehicle, seed), hover_thrusts(scene, self.vehicle))

    def _start(self, position: np.ndarray, yaw: float, thrusts: np.ndarray) -> None:
        self.data.qpos[:3] = FLIP * position
        self.data.qpos[3:7] = FLIP_QUATERNION * (math.cos(0.5 * yaw), 0.0, 0.0, math.sin(0.5 * yaw))
        self.data.act[:] = self.data.ctrl[:] = thrusts
        mujoco.mj_forward(self.model, self.data)
        self._sensors = [self._sensordata.tolist()] * STEPS_PER_TICK
        self._pushes = [0.0] * STEPS_PER_TICK
        self._refresh()

    def _refresh(self) -> None:
        """Convert the state once per tick; plain numbers, because arrays of three cost ten times their arithmetic."""
        x, y, z, qw, qx, qy, qz = self._qpos.tolist()
        vx, vy, vz, wx, wy, wz = self._qvel.tolist()
        self._position, self._quaternion = (x, -y, -z), (qw, qx, -qy, -qz)
        self._rotation = rotation_rows(qw, qx, -qy, -qz)
        self._world_velocity, self._angular_velocity = (vx, -vy, -vz), (wx, -wy, -wz)

    def step(self, thrusts: np.ndarray) -> None:
        """Advance one control tick of 4 ms under constant commanded thrusts.

        Args:
            thrusts: Commanded thrusts [N], (n,); clipped to the true limits. One that is no number ends the flight.
        """
        if self.crashed == NOT_FINITE or not math.isfinite(sum(thrusts.tolist())):
            self.crashed, self.time_ns = self.crashed or NOT_FINITE, self.time_ns + TICK_NS
            return
        model, data, sensordata, command = self.model, self.data, self._sensordata, self._ctrl
        np.minimum(np.maximum(thrusts, self._lower, out=command), self._upper, out=command)
        # Under a constant command a first-order lag never crosses it, so one choice holds for the tick.
        self._lag[:] = self._lags[1]
        np.copyto(self._lag, self._lags[0], where=np.greater_equal(command, self._act, out=self._rising))
        self._apply_air()
        self._sensors = sensors = []
        for _ in range(STEPS_PER_TICK):
            mujoco.mj_step(model, data)
            sensors.append(sensordata.tolist())
        self.time_ns += TICK_NS
        found = self._ids.contact.start
        self._pushes = [row[found + 1] if row[found] > 0.0 else 0.0 for row in sensors]
        self._refresh()
        self.crashed = self.crashed or crash_reason(self._position, self._rotation, self.clearance)

    def _apply_air(self) -> None:
        """Drag and gusts at the true centre of mass, as force and moment at the bare vehicle's."""
        force = self.wind.force(self._velocity_of(self._centre_list))
        moment = turned(self._rotation, cross_product(self._drag_arm, turned_back(self._rotation, force)))
        (fx, fy, fz), (mx, my, mz) = force, moment
        self._applied[:] = fx, -fy, -fz, mx, -my, -mz

    @property
    def thrust_limits(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper limits of the real rotors now [N], (n,) each; a fault may set new ones."""
        return self._lower, self._upper

    @thrust_limits.setter
    def thrust_limits(self, limits: tuple[np.ndarray, np.ndarray]) -> None:
        self._lower, self._upper = (np.array(limit, float) for limit in limits)
