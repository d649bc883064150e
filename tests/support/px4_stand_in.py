"""A process that stands in for PX4 and a vehicle before a wall: sensors out, motors in, Offboard mode and its failsafe.

What PX4 does is taken from its guide ("Offboard Mode"): it enters Offboard mode only with a proof of life younger than
COM_OF_LOSS_T, and leaves it when that is older; nothing else is modelled. The vehicle is a rigid body with lagging
rotors that Offboard mode alone moves; a camera in a process of its own draws the board and the wall behind it.

    python px4_stand_in.py '{"domain": 7, "duration_s": 3}'      prints one line of JSON at the end
"""

from __future__ import annotations

import json
import math
import multiprocessing
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from scipy.spatial.transform import Rotation
from small_vehicle import SmallVehicle

from ibvs_qp.config import ControllerConfig
from ibvs_qp.frames import R_BODY_CAMERA, cross
from ibvs_qp.interfaces.px4.dds import Participant
from ibvs_qp.interfaces.px4.inputs import CONTROL_MODE
from ibvs_qp.interfaces.px4.thrust_curve import ThrustCurve
from ibvs_qp.interfaces.ros import pictures, samples
from ibvs_qp.interfaces.ros.messages import (
    CAMERA_INFO,
    IMAGE,
    SENSOR_COMBINED,
    VEHICLE_ATTITUDE,
    WRENCH,
    decoded,
    message,
    to_px4,
)
from ibvs_qp.interfaces.ros.topics import Px4Topics
from ibvs_qp.measurement import RgbdFrame
from ibvs_qp.pilot.runner import run

#: Size, focal length [px] and principal point of the camera.
SHAPE, FOCAL, CENTRE = (240, 424), 312.6, (211.5, 119.5)
#: Board: left, right, upper and lower edge from the start of the tip [m], wall behind it [m], grey levels of both.
BOARD, GAP, GREYS = (-8.0, 0.05, -0.60, 0.05), 0.05, (190.0, 70.0)
CURVE = ThrustCurve(quadratic=0.0)
RATE_HZ = 250.0


@dataclass(kw_only=True)
class Plan:
    """What happens, in seconds since Offboard mode began; NaN for never."""

    domain: int
    duration_s: float  # at most
    away_m: float = math.inf  # ends the run: distance of the tip after the first contact
    loss_timeout_s: float = 0.3  # COM_OF_LOSS_T
    wait_s: float = 90.0  # longest wait for proof of life
    silent_at_s: float = math.nan  # the inertial data stop
    leave_at_s: float = math.nan  # the operator leaves Offboard mode
    picture_hz: float = 15.0
    flip_axes: bool = False  # the accelerometer is FLU: the self-check must find it


class Px4:
    """Mode, failsafe, and what it saw of the bridge."""

    def __init__(self, plan: Plan) -> None:
        self.plan, self.engaged, self.failsafe_s = plan, False, None
        self.alive_us: int | None = None
        self.alive_times: list[float] = []
        self.early = 0  # setpoints outside Offboard mode
        self.sent: list[tuple[float, float, float]] = []  # arrival, sending, and inertial data that it answers [s]
        self.thrusts: np.ndarray | None = None

    def alive(self, now_us: int) -> bool:
        """Whether there is proof of life."""
        return self.alive_us is not None and now_us - self.alive_us < 1e6 * self.plan.loss_timeout_s


class Vehicle(SmallVehicle):
    """The small vehicle with a tool on its force sensor and noise on every sensor."""

    def __init__(self, distance: float) -> None:
        super().__init__(ControllerConfig(), distance=distance)
        self._rng = np.random.default_rng(0)

    def noisy(self, values: Any, sigma: float) -> np.ndarray:
        return np.asarray(values, float) + self._rng.normal(0.0, sigma, np.shape(values))

    def wrench(self) -> np.ndarray:
        """Raw sample of the force sensor: vehicle on tool, FRD."""
        sensor = np.array(self.vehicle.force_torque_position_m)
        load = self.vehicle.tool_mass_kg * self.specific_force
        force = load - self.contact[:3]
        arm, tip = np.array(self.vehicle.tool_position_m) - sensor, self.tip - sensor
        moment = np.array(cross(arm, load)) - np.array(cross(tip, self.contact[:3]))
        return self.noisy(np.concatenate((force, moment)), 0.05)


class Camera:
    """Pictures of a speckled board before a wall."""

    def __init__(self, wall: float, centre: tuple[float, float, float]) -> None:
        self._wall, self._centre, self._rng = wall, np.array(centre), np.random.default_rng(1)
        rows, columns = np.indices(SHAPE)
        rays = np.dstack(((columns - CENTRE[0]) / FOCAL, (rows - CENTRE[1]) / FOCAL, np.ones(SHAPE)))
        self._rays = (rays @ R_BODY_CAMERA.T).astype(np.float32)  # in B, depth 1
        self._speckles = cv2.GaussianBlur(self._rng.normal(0.0, 60.0, (512, 512)).astype(np.float32), (0, 0), 2.0)

    def picture(self, position: np.ndarray, attitude: np.ndarray, stamp_ns: int) -> RgbdFrame:
        """Picture from a pose: position [m] and quaternion (x, y, z, w)."""
        turn = Rotation.from_quat(attitude).as_matrix().astype(np.float32)
        rays = self._rays @ turn.T
        origin = position + turn @ self._centre
        depth = np.float32(self._wall - origin[0]) / rays[..., 0]
        y, z = (np.float32(origin[axis]) + depth * rays[..., axis] for axis in (1, 2))
        left, right, upper, lower = BOARD
        board = (left < y) & (y < right) & (upper < z) & (z < lower)
        row, column = ((1000.0 * each).astype(np.int32) & 511 for each in (z, y))  # one speckle entry per mm
        grey = np.where(board, *GREYS) + self._speckles[row, column] + self._rng.integers(-3, 4, SHAPE)
        rgb = np.repeat(np.clip(grey, 0, 255).astype(np.uint8)[..., None], 3, axis=2)
        depth = np.where(board, depth, depth + GAP / rays[..., 0])
        depth *= 1.0 + 0.003 * self._rng.standard_normal(SHAPE, np.float32)
        return RgbdFrame(rgb=rgb, depth=depth, intrinsics=(FOCAL, FOCAL, *CENTRE), stamp_ns=stamp_ns)


class CameraTopics:
    """Publishes pictures of a pose."""

    def __init__(self, part: Participant, camera: Camera) -> None:
        topics = Px4Topics()
        self._camera = camera
        self._color, self._depth = part.writer(topics.color, IMAGE), part.writer(topics.depth, IMAGE)
        self._info = part.writer(topics.camera_info, CAMERA_INFO)

    def publish(self, position: np.ndarray, attitude: np.ndarray, stamp_ns: int) -> None:
        picture = self._camera.picture(position, attitude, stamp_ns)
        self._info.write(pictures.from_intrinsics(picture.intrinsics, SHAPE, stamp_ns))
        self._color.write(pictures.from_rgb(picture.rgb, stamp_ns))
        self._depth.write(pictures.from_depth(picture.depth, stamp_ns))


def run_camera(domain: int, rate_hz: float, camera: Camera, pose: Any) -> None:
    """Publish pictures of the pose, position and quaternion, that the parent process writes, as long as it lives."""
    parent, topics = multiprocessing.parent_process(), CameraTopics(Participant(domain), camera)
    while parent is None or parent.is_alive():
        begin, stamp = time.monotonic(), time.time_ns()
        with pose.get_lock():
            now = np.array(pose[:])
        topics.publish(now[:3], now[3:], stamp)
        time.sleep(max(0.0, 1.0 / rate_hz - (time.monotonic() - begin)))


class StandIn:
    """Publishes and receives once a tick.

    Args:
        plan: What happens.
        clock: Clock of the stamps [ns] of a flight in lock-step, whose pictures are then drawn within the tick; None is
            that of the computer, with the camera in a process of its own.
    """

    def __init__(self, plan: Plan, clock: Callable[[], int] | None = None) -> None:
        self.plan, self.px4, self.vehicle = plan, Px4(plan), Vehicle(distance=0.3)
        self._clock, self._camera = clock or time.time_ns, None
        self._pose = multiprocessing.Array("d", [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])
        camera = Camera(self.vehicle.wall, self.vehicle.vehicle.camera_position_m)
        if clock is None:  # before DDS starts here: its threads do not survive a fork
            arguments = plan.domain, plan.picture_hz, camera, self._pose
            multiprocessing.Process(target=run_camera, args=arguments, daemon=True).start()
        part, topics = Participant(plan.domain), Px4Topics()
        if clock is not None:
            self._camera = CameraTopics(part, camera)
        self._imu = part.writer(topics.imu, SENSOR_COMBINED)
        self._attitude = part.writer(topics.attitude, VEHICLE_ATTITUDE)
        self._wrench = part.writer(topics.wrench, WRENCH)
        self._mode = part.writer("/fmu/out/vehicle_control_mode", CONTROL_MODE)
        self._motors = part.reader("/fmu/in/actuator_motors", "px4_msgs/msg/ActuatorMotors")
        self._alive = part.reader("/fmu/in/offboard_control_mode", "px4_msgs/msg/OffboardControlMode")
        self._first: float | None = None  # begin, and begin of Offboard mode [s]
        self.began: float | None = None
        self._ticks, self.left, self._touched = 0, False, False

    def tick(self, now_ns: int) -> bool:
        now_s, stamp = now_ns * 1e-9, self._clock()
        self._first = now_s if self._first is None else self._first
        self._receive(now_s)
        self._switch(now_s, stamp // 1000)
        since = -1.0 if self.began is None else now_s - self.began
        if self.px4.engaged and self.px4.thrusts is not None:
            self.vehicle.fly(self.px4.thrusts)
        silent = since >= self.plan.silent_at_s
        self._send(stamp, silent=silent)
        self._ticks += 1
        if self.began is None:
            return now_s - self._first < self.plan.wait_s
        self._touched |= self.vehicle.distance < 0.0
        return since < self.plan.duration_s and not (self._touched and self.vehicle.distance > self.plan.away_m)

    def _receive(self, now_s: float) -> None:
        for data in self._alive.take():
            value = decoded(data, "px4_msgs/msg/OffboardControlMode")
            assert value.direct_actuator and not (value.position or value.thrust_and_torque)
            self.px4.alive_us = value.timestamp
            self.px4.alive_times.append(now_s)
        for data in self._motors.take():
            value = decoded(data, "px4_msgs/msg/ActuatorMotors")
            if not self.px4.engaged:
                self.px4.early += self.began is None
                continue
            count = len(self.vehicle.thrusts)
            assert np.isnan(value.control[count:]).all() and np.isfinite(value.control[:count]).all()
            self.px4.thrusts = CURVE.thrusts(value.control[:count])
            self.px4.sent.append((now_s, 1e-6 * value.timestamp, 1e-6 * value.timestamp_sample))

    def _switch(self, now_s: float, now_us: int) -> None:
        """Enter and leave Offboard mode as PX4 does."""
        px4 = self.px4
        if self.began is None:
            # The operator switches as soon as PX4 allows it and the proof of life has lasted a second.
            lasted = bool(px4.alive_times) and now_s - px4.alive_times[0] > 1.0
            if px4.alive(now_us) and lasted:
                self.began, px4.engaged = now_s, True
        elif px4.engaged and not px4.alive(now_us):
            px4.engaged, px4.failsafe_s = False, now_s - self.began
        elif px4.engaged and now_s - self.began >= self.plan.leave_at_s:
            px4.engaged, self.left = False, True

    def _send(self, stamp: int, *, silent: bool) -> None:
        vehicle, us = self.vehicle, to_px4(stamp)
        if not silent:
            force = vehicle.noisy(vehicle.specific_force, 0.02) * ([1, -1, -1] if self.plan.flip_axes else [1, 1, 1])
            self._imu.write(
                message(
                    SENSOR_COMBINED,
                    timestamp=us,
                    gyro_rad=vehicle.noisy(vehicle.omega, 1e-3).astype(np.float32),
                    accelerometer_m_s2=force.astype(np.float32),
                )
            )
            x, y, z, w = vehicle.attitude.as_quat()
            quaternion = vehicle.noisy((w, x, y, z), 3e-4)
            quaternion /= np.linalg.norm(quaternion)
            q = quaternion.astype(np.float32)
            self._attitude.write(message(VEHICLE_ATTITUDE, timestamp=us, timestamp_sample=us, q=q))
        if self._ticks % 2 == 0:
            self._wrench.write(samples.to_wrench(stamp, vehicle.wrench(), "flu", "tool"))
        if self._ticks % 5 == 0:
            self._mode.write(control_mode(us, armed=self.px4.engaged, offboard=self.px4.engaged))
        with self._pose.get_lock():
            self._pose[:] = [*vehicle.position, *vehicle.attitude.as_quat()]
        if self._camera and self._ticks % round(RATE_HZ / self.plan.picture_hz) == 0:
            self._camera.publish(vehicle.position, vehicle.attitude.as_quat(), stamp)

    def report(self) -> dict[str, Any]:
        """What PX4 saw."""
        arrived, sent, sampled = np.array(self.px4.sent).reshape(-1, 3).T
        began = self.began

        def spread(seconds: np.ndarray) -> list[float] | None:
            """Median, 99 %, 99.9 %, and largest [ms]."""
            return np.percentile(1e3 * seconds, (50, 99, 99.9, 100)).tolist() if len(seconds) else None

        return {
            "offboard": began is not None,
            "commands": len(sent),
            "early": self.px4.early,
            "span_s": float(sent[-1] - sent[0]) if len(sent) else 0.0,
            "last_command_s": float(arrived[-1] - began) if began is not None and len(sent) else None,
            "failsafe_s": self.px4.failsafe_s,
            "gap_ms": spread(np.diff(sent)),
            "age_ms": spread(sent - sampled),
            "alive_gap_ms": spread(np.diff(self.px4.alive_times)),
            "moved_m": self.vehicle.position.tolist(),
            "distance_m": self.vehicle.distance,
            "push_n": float(-self.vehicle.contact[0]),
        }


def control_mode(us: int, *, armed: bool, offboard: bool) -> Any:
    flags = {"flag_armed": armed, "flag_control_offboard_enabled": offboard}
    return message(CONTROL_MODE, timestamp=us, source_id=14 if offboard else 2, **flags)


def main() -> None:
    stand_in = StandIn(Plan(**json.loads(sys.argv[1])))
    timing = run(stand_in.tick, RATE_HZ)
    print(json.dumps(stand_in.report() | {"left_out": timing.left_out, "ticks": timing.ticks}))


if __name__ == "__main__":
    main()
