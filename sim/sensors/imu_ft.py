"""IMU and force/torque sensor: the truth with rate, noise, bias and delay."""

from __future__ import annotations

import functools
import math
from collections import deque
from collections.abc import Sequence
from typing import Any

import casadi as ca
import numpy as np

from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.measurement import FeatureFrame, RgbdFrame, SensorFrame
from ibvs_qp.model.bound_function import BoundFunction
from sim.world.plant import Plant
from sim.world.random_streams import NormalRows, Normals, stream
from sim.world.readout import PLACES, SIZE
from sim.world.scene import ForceTorqueScene, ImuScene, Scene

NS = 1_000_000_000
_WRENCH = PLACES["ft_wrench"]


class SampleClock:
    """Sample times of a sensor; integer nanoseconds, so that no rounding drifts.

    A sample falls on the first control tick at or after its time; a sensor faster than the ticks samples on each.

    Attributes:
        next_ns: Time of the next sample [ns].
    """

    def __init__(self, rate_hz: float) -> None:
        self._rate = rate_hz
        self._count = self.next_ns = 0

    def due(self, now_ns: int) -> bool:
        """Whether a sample is due at this tick."""
        if now_ns < self.next_ns:
            return False
        while self.next_ns <= now_ns:
            self._count += 1
            self.next_ns = round(self._count * NS / self._rate)
        return True


def multiply(a: Sequence[Any], b: Sequence[Any]) -> tuple[Any, Any, Any, Any]:
    """Product of two quaternions (w, x, y, z) of plain numbers or symbols."""
    (aw, ax, ay, az), (bw, bx, by, bz) = a, b
    return (
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    )


def small_turn(vector: Sequence[float]) -> tuple[float, float, float, float]:
    """Unit quaternion of a rotation vector of a few degrees [rad]."""
    x, y, z = vector
    x, y, z = 0.5 * x, 0.5 * y, 0.5 * z
    length = math.sqrt(1.0 + x * x + y * y + z * z)
    return 1.0 / length, x / length, y / length, z / length


class Imu:
    r"""Gyro, accelerometer and the attitude estimate of a flight controller, held between samples.

    White noise of density :math:`\sigma` gives :math:`\sigma \sqrt{rate}` per sample. The attitude estimate is off
    by a constant tilt in a random direction and turned by an arbitrary yaw, both fixed by the seed.
    """

    def __init__(self, scene: ImuScene, seed: int) -> None:
        self._clock = SampleClock(scene.rate_hz)
        root = math.sqrt(scene.rate_hz)
        attitude = stream(seed, "attitude")
        direction, yaw = attitude.uniform(-math.pi, math.pi, 2).tolist()
        size = math.radians(scene.attitude_bias_deg)
        tilt = size * math.cos(direction), size * math.sin(direction)
        sigmas = math.radians(scene.attitude_noise_deg), scene.gyro_density * root, scene.accel_density * root
        self._settings = np.array((*sigmas, *tilt, math.cos(0.5 * yaw), math.sin(0.5 * yaw), 1.0))
        self._noise = NormalRows((attitude, stream(seed, "gyro"), stream(seed, "accelerometer")), 3)
        self._kick, self._sample = np.zeros(9), np.zeros(10)
        self._plant: Plant | None = None
        self.attitude = self.angular_velocity = self.specific_force = np.zeros(0)

    def _bind(self, plant: Plant) -> None:
        self._plant = plant
        self._read = BoundFunction(imu_function(), (plant.truth, self._kick, self._settings), (self._sample,))

    def sample(self, plant: Plant) -> None:
        """Take a sample if one is due."""
        clock, now = self._clock, plant.time_ns
        if now < clock.next_ns or not clock.due(now):
            return
        if plant is not self._plant:
            self._bind(plant)
        self._kick[:] = self._noise.take()
        self._read()
        sample = self._sample.copy()
        self.attitude, self.angular_velocity, self.specific_force = sample[:4], sample[4:7], sample[7:]


@functools.cache
def imu_function() -> ca.Function:
    """Function of (readings, nine normal numbers, settings) yielding attitude, angular velocity and specific force."""
    truth, kick, settings = ca.SX.sym("truth", SIZE), ca.SX.sym("kick", 9), ca.SX.sym("settings", 8)
    # The one is a symbol: CasADi folds a literal's division into the products, which rounds differently.
    spread, gyro, accel, tilt_x, tilt_y, yaw_w, yaw_z, one = (settings[index] for index in range(8))
    quaternion, rate, felt = (truth[PLACES[name]] for name in ("quaternion", "rate", "felt"))
    vector = tilt_x + spread * kick[0], tilt_y + spread * kick[1], spread * kick[2]
    x, y, z = (0.5 * entry for entry in vector)
    length = ca.sqrt(one + x * x + y * y + z * z)
    turn = one / length, x / length, y / length, z / length
    attitude = multiply((yaw_w, 0.0, 0.0, yaw_z), multiply([quaternion[index] for index in range(4)], turn))
    sample = ca.vertcat(*attitude, rate + gyro * kick[3:6], felt + accel * kick[6:9])
    return ca.Function("imu", [truth, kick, settings], [ca.densify(sample)])


class ForceTorque:
    """Force/torque sensor with noise, a force bias of constant size and random direction, and a delivery delay.

    The first sample of a flight is delivered without delay, so that every frame has one.
    """

    def __init__(self, scene: ForceTorqueScene, seed: int) -> None:
        self._clock = SampleClock(scene.rate_hz)
        self._latency_ns = round(scene.latency_s * NS)
        self._sigma = np.array([scene.sigma_n] * 3 + [scene.sigma_nm] * 3)
        self._noise = Normals(stream(seed, "force_torque"))
        direction = np.array(self._noise.take(3))
        self.bias = np.concatenate((scene.bias_n * direction / np.linalg.norm(direction), np.zeros(3)))
        self._line: deque[tuple[int, np.ndarray]] = deque()
        self.wrench, self.stamp_ns = np.zeros(0), 0

    def sample(self, plant: Plant) -> None:
        """Take a sample if one is due, and deliver those whose delay is over."""
        now, line, clock = plant.time_ns, self._line, self._clock
        if now >= clock.next_ns and clock.due(now):
            line.append((now, plant.truth[_WRENCH] + self.bias + self._sigma * self._noise.take(6)))
        while line and (line[0][0] + self._latency_ns <= now or not self.wrench.size):
            self.stamp_ns, self.wrench = line.popleft()


class SensorSuite:
    """All sensors but the camera.

    Args:
        scene: Rates, noise, biases and delays.
        vehicle: The vehicle that carries them.
        seed: Same seed, same noise to the bit; each sensor has its own stream.
    """

    def __init__(self, scene: Scene, vehicle: VehicleParams | None = None, seed: int = 0) -> None:
        self.vehicle = vehicle or VehicleParams()
        self.imu = Imu(scene.imu, seed)
        self.force_torque = ForceTorque(scene.force_torque, seed)

    def sample(self, plant: Plant, image: RgbdFrame | None = None, features: FeatureFrame | None = None) -> SensorFrame:
        """What the vehicle delivers at this control tick, with the picture or the features that are due."""
        imu, force_torque = self.imu, self.force_torque
        imu.sample(plant)
        force_torque.sample(plant)
        return SensorFrame(
            stamp_ns=plant.time_ns,
            attitude=imu.attitude,
            angular_velocity=imu.angular_velocity,
            specific_force=imu.specific_force,
            wrench=force_torque.wrench,
            wrench_stamp_ns=force_torque.stamp_ns,
            image=image,
            features=features,
        )
