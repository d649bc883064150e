"""The truth: vehicle, air and contact, advanced one control tick at a time; NED and FRD on every face."""

# MuJoCo's bindings carry no types.
# pyright: reportAttributeAccessIssue=false
from __future__ import annotations

import math

import mujoco
import numpy as np

from ibvs_qp.config import ControllerConfig
from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.symbolic.function import BoundFunction
from sim.world.board import BoardGeometry
from sim.world.clearance import PropellerClearance
from sim.world.crash import crash_reason, has_landed
from sim.world.errors import RotorErrors
from sim.world.face import TIP_RADIUS_M, Face
from sim.world.mjcf import STEP_NS, build_model
from sim.world.mujoco_frames import FLIP, FLIP_QUATERNION
from sim.world.readings import PlantReadings
from sim.world.readout import CONTACT_NUMBERS, PLACES, SIZE, drive, readout
from sim.world.rotor_errors import ThrustFactors
from sim.world.scene import Scene
from sim.world.touch import Touch
from sim.world.trim import hover_thrusts, start_pose
from sim.world.true_vehicle import true_vehicle
from sim.world.wall_air import WallAir
from sim.world.wind import Wind

#: Crash reason after a non-finite command; physics stops from then on.
NOT_FINITE = "non-finite thrust command"
_SAFE, _TIP, _FRICTION = PLACES["safe"].start, PLACES["tip"], PLACES["friction"]
_FALL = slice(PLACES["depth"].start, PLACES["upright"].stop)


class Plant(PlantReadings):
    """The simulated vehicle in its scene.

    The body frame has its origin at the ASSUMED centre of mass (positions of `VehicleParams`); the true one lies
    ``com_offset_m`` of `TrueVehicle` away. Starts level and at rest with the rotors at hover, at the scene's start pose
    varied by the seed. Same scene, seed and thrusts: same bits.

    Attributes:
        time_ns: Simulated time since the start [ns].
        crashed: Why the flight is over (propeller strike, ground, flip, non-finite state), or None.
        landed: Whether it is over because the vehicle touched down.
        wind: The air; its mean may be changed in flight.
        gain: True over commanded thrust of every rotor, (n,); may be changed in flight.
        outer_force: Force at the true centre of mass in addition to that of the air, NED [N], or None.
        truth: Present readings, see `sim.world.readout.PLACES`; a view, valid until the next tick, read-only.
        pushes: Contact force into the wall at every physics step of the last tick [N], likewise: of a relief the whole
            force along the wall's normal.
        tick_ns: The control tick [ns].

    Args:
        scene: The truth.
        vehicle: Nominal vehicle of the controller; the scene's section ``plant`` and its errors make it the true one.
        seed: Varies start pose, gusts and errors.
        tick_s: Control tick, a whole number of physics steps [s].
        drawn: Whether the model holds the geometry that a window shows; the motion is bit-identical.
    """

    def __init__(
        self,
        scene: Scene,
        vehicle: VehicleParams | None = None,
        seed: int = 0,
        tick_s: float = ControllerConfig.tick_s,
        drawn: bool = True,
    ) -> None:
        self.scene, self.vehicle = scene, true_vehicle(scene, vehicle or VehicleParams(), seed)
        self._steps = round(tick_s * 1e9) // STEP_NS
        self.tick_ns = self._steps * STEP_NS
        self.model, self._ids = build_model(scene, self.vehicle, self._steps, drawn)
        self.data = mujoco.MjData(self.model)
        self._lower, self._upper = self.vehicle.thrust_min, self.vehicle.thrust_max
        self._board = board = BoardGeometry(scene)
        self.clearance = PropellerClearance(board, self.vehicle)
        face = self._ids.face
        self._flexible = scene.errors.arm.mode_hz > 0.0
        self._face = Face(board, self.model.geom_pos[face], self.model.geom_quat[face])
        self._touch = Touch(board, self._face, self.model, self._ids, seed)
        drag = self.vehicle.linear_drag_n_s_m
        self.wind = Wind(scene.wind, scene.errors.air, board.from_ned, drag, self.tick_ns * 1e-9, seed)
        rotors, count = scene.errors.rotors, self.vehicle.geometry.count
        self._factors = ThrustFactors(rotors, count, self.tick_ns * 1e-9, seed) if rotors != RotorErrors() else None
        air = scene.errors.air
        disturbed = air.wall_thrust or air.ground_thrust or air.recirculation
        self._wall_air = WallAir(air, board, self.vehicle, self.tick_ns * 1e-9, seed) if disturbed else None
        self.time_ns = 0
        self.crashed: str | None = None
        self.landed = False
        self.outer_force: tuple[float, float, float] | None = None
        self._bind()
        self._start(*start_pose(scene, self.vehicle, seed), hover_thrusts(self.vehicle))

    def _bind(self) -> None:
        """Bind the CasADi functions to MuJoCo's arrays: fetching those at every tick costs more than reading them."""
        model, data, ids, truth = self.model, self.data, self._ids, self.vehicle
        self._act = data.act
        centre = np.array(truth.com_offset_m)
        board = self._board
        reach = self.clearance.reach if board.surface.flat else math.inf  # then every tick looks for a strike
        points = np.concatenate((centre, truth.tip_position_m, [reach], board.down[::2], [board.ground]))
        self.truth, self.pushes = np.zeros(SIZE), np.zeros(self._steps)
        self._centre_velocity = self.truth[PLACES["centre_velocity"]]
        self._read = BoundFunction(
            readout(model.nhistory, *ids.remembered, self._steps),
            (data.qpos[:7], data.qvel[:6], data.history, points),  # a flexible arm has further ones
            (self.truth, self.pushes),
        )
        self._commanded, self._air, self._lags = np.zeros(model.nu), np.zeros(3), np.zeros(model.nu)
        self.gain = np.array(np.broadcast_to(truth.thrust_gain, model.nu), float)
        self._lag = model.actuator_dynprm[:, 0]
        lags = np.array((truth.motor_lag_up_s, truth.motor_lag_down_s))
        # Moment arm from the bare vehicle's centre of mass, where MuJoCo applies forces, to the whole one's.
        arm = centre - FLIP * model.body_ipos[ids.vehicle]
        self._drive = BoundFunction(
            drive(model.nu),
            (self._commanded, self._lower, self._upper, data.act, lags, self._air, self.truth[PLACES["rotation"]], arm),
            (data.ctrl, self._lags, data.xfrc_applied[ids.vehicle]),
        )

    def _start(self, position: np.ndarray, attitude: np.ndarray, thrusts: np.ndarray) -> None:
        self.data.qpos[:3] = FLIP * position
        self.data.qpos[3:7] = FLIP_QUATERNION * attitude
        self.data.act[:] = self.data.ctrl[:] = thrusts
        mujoco.mj_forward(self.model, self.data)
        ids, sensed, history = self._ids, self.data.sensordata, self.data.history
        for start, place in zip(ids.remembered, (ids.accelerometer, ids.force, ids.torque, ids.contact), strict=True):
            now = sensed[place]
            history[start : start + self._steps * len(now)] = np.tile(now, self._steps)
        self._sense()

    def _sense(self) -> None:
        """Read the state; tip and friction in the chart."""
        self._read()
        surface = self._board.surface
        if self._flexible:
            mujoco.mj_kinematics(self.model, self.data)
            tip, ahead = self.data.geom_xpos[self._ids.tip], self.data.geom_xmat[self._ids.tip][::3]
            self.truth[_TIP] = FLIP * (tip + TIP_RADIUS_M * ahead)
        if surface.flat and not self._touch.rough:
            return
        chart = surface.chart(self.truth[_TIP])
        axes = surface.axes(chart)
        if self._touch.rough:
            self._read_rough_contact(FLIP * axes[:, 0])
        if not surface.flat:
            self.truth[_FRICTION] = self.truth[_FRICTION] @ axes
            self.truth[_TIP] = chart

    def _read_rough_contact(self, normal: np.ndarray) -> None:
        """Push and friction of a relief: the whole contact force along the normal of the wall, and the rest of it.

        The contact of a slope has another normal, and its friction a share in the push.

        Args:
            normal: Unit vector into the wall, in MuJoCo's world, (3,).
        """
        start = self._ids.remembered[3]
        samples = self.data.history[start : start + CONTACT_NUMBERS * self._steps].reshape(self._steps, -1)
        found, forces, first, second = samples[:, :1], samples[:, 1:4], samples[:, 4:7], samples[:, 7:10]
        axes = np.stack((first, second, np.cross(first, second)), axis=1)
        on_board = np.where(found > 0.0, np.einsum("si,sij->sj", forces, axes), 0.0)
        self.pushes[:] = on_board @ normal
        self.truth[PLACES["push"]] = self.pushes[-1]
        self.truth[_FRICTION] = FLIP * (self.pushes[-1] * normal - on_board[-1])

    def step(self, thrusts: np.ndarray) -> None:
        """Advance one control tick under constant commanded thrusts.

        Args:
            thrusts: Commanded thrusts [N], (n,); clipped to the true limits. A non-finite one ends the flight.
        """
        if self.crashed == NOT_FINITE or not math.isfinite(sum(thrusts.tolist())):
            self.crashed, self.time_ns = self.crashed or NOT_FINITE, self.time_ns + self.tick_ns
            return
        commanded = thrusts * self.gain
        if self._factors is not None:
            commanded = commanded * self._factors.next()
        if self._wall_air is not None:
            commanded = commanded * self._wall_air.factors(self.position, self.rotation)
        self._commanded[:] = commanded
        self._air[:] = self.wind.force(self._centre_velocity.tolist(), -self.truth.item(_FALL.start))
        if self.outer_force is not None:
            self._air += self._board.from_ned @ self.outer_force
        self._drive()
        self._lag[:] = self._lags
        struck = self._face.follow(self.truth[_TIP].tolist())
        if not self._touch.needed:
            mujoco.mj_step(self.model, self.data, self._steps)
        else:
            for _ in range(self._steps):
                self._touch.prepare(self.data)
                mujoco.mj_step(self.model, self.data)
        self.time_ns += self.tick_ns
        self._sense()
        if self.truth.item(_SAFE) != 1.0 and not self.over:
            depth, sink, upright = self.truth[_FALL].tolist()
            position, rotation = self.position.tolist(), self.rotation.tolist()
            self.landed = has_landed(depth, upright, sink)
            crash = None if self.landed else crash_reason(position, rotation, depth, upright, self.clearance)
            self.crashed = crash
        if struck and not self.over:
            self.crashed = struck

    @property
    def on_board(self) -> bool:
        """Whether the tip lies inside the board's outline; outside it the wall takes the push."""
        return self._face.on_board

    @property
    def over(self) -> bool:
        """Whether the flight is over: crashed or landed."""
        return self.landed or self.crashed is not None

    def displace(self, offset: np.ndarray) -> None:
        """Move the vehicle at once by an offset in the world [m], (3,): as if everything else had moved back."""
        self.data.qpos[:3] += FLIP * offset
        self._touch.jumped()
        self._sense()

    def set_wall(self, stiffness: float, friction: float) -> float:
        """Another wall before the tip.

        Args:
            stiffness: Of the contact, that of the first touch of bristles [N/m].
            friction: Coulomb coefficient, the sliding one of bristles.

        Returns:
            How much deeper the tip lies in the new wall under the same push at rest [m].
        """
        return self._touch.set_wall(stiffness, friction, self.tip)

    @property
    def normal(self) -> np.ndarray:
        """Unit vector into the wall at the tip, world, (3,)."""
        return self._board.surface.axes(self.tip)[:, 0]

    @property
    def thrust_limits(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper limits of the real rotors now [N], (n,) each; a fault may set new ones."""
        return self._lower.copy(), self._upper.copy()

    @thrust_limits.setter
    def thrust_limits(self, limits: tuple[np.ndarray, np.ndarray]) -> None:
        self._lower[:], self._upper[:] = limits
