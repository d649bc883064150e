"""IMU and force/torque sensor: rate, noise, bias and delay; truth comes in, what a vehicle delivers goes out."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence

import numpy as np

from ibvs_qp.measurement import SensorFrame
from ibvs_qp.vehicle import VehicleParams
from sim.plant import Plant
from sim.scene import ForceTorqueScene, ImuScene, Scene
from sim.streams import Normals, stream

NS = 1_000_000_000


class SampleClock:
    """Says when a sensor of a given rate samples; integer nanoseconds, so that no rounding drifts.

    A sample falls on the first control tick at or after its time; a sensor faster than the ticks samples on each.
    """

    def __init__(self, rate_hz: float) -> None:
        self._rate = rate_hz
        self._count = self._next = 0

    def due(self, now_ns: int) -> bool:
        """Whether a sample is due at this tick."""
        if now_ns < self._next:
            return False
        while self._next <= now_ns:
            self._count += 1
            self._next = round(self._count * NS / self._rate)
        return True


def multiply(a: Sequence[float], b: Sequence[float]) -> tuple[float, float, float, float]:
    """Product of two quaternions (w, x, y, z)."""
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
        self._gyro_sigma, self._accel_sigma = scene.gyro_density * root, scene.accel_density * root
        self._attitude_sigma = math.radians(scene.attitude_noise_deg)
        self._gyro, self._accel = Normals(stream(seed, "gyro")), Normals(stream(seed, "accelerometer"))
        attitude = stream(seed, "attitude")
        direction, yaw = attitude.uniform(-math.pi, math.pi, 2).tolist()
        self._attitude = Normals(attitude)
        size = math.radians(scene.attitude_bias_deg)
        self._tilt = size * math.cos(direction), size * math.sin(direction)
        self._yaw = math.cos(0.5 * yaw), 0.0, 0.0, math.sin(0.5 * yaw)
        self.attitude = self.angular_velocity = self.specific_force = np.zeros(0)

    def sample(self, plant: Plant) -> None:
        """Take a sample if one is due."""
        if not self._clock.due(plant.time_ns):
            return
        (i, j, k), sigma, (tilt_x, tilt_y) = self._attitude.take(3), self._attitude_sigma, self._tilt
        turn = small_turn((tilt_x + sigma * i, tilt_y + sigma * j, sigma * k))
        motion = plant.motion
        self.attitude = np.array(multiply(self._yaw, multiply(motion[6:10], turn)))
        (i, j, k), sigma, (x, y, z) = self._gyro.take(3), self._gyro_sigma, motion[10:]
        self.angular_velocity = np.array((x + sigma * i, y + sigma * j, z + sigma * k))
        (i, j, k), sigma, (x, y, z) = self._accel.take(3), self._accel_sigma, plant.felt
        self.specific_force = np.array((x + sigma * i, y + sigma * j, z + sigma * k))


class ForceTorque:
    """Force/torque sensor with noise, a force bias of constant size and random direction, and a delivery delay.

    The first sample of a flight is delivered at once, so that there is always one.
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
        now = plant.time_ns
        if self._clock.due(now):
            self._line.append((now, plant.ft_wrench + self.bias + self._sigma * self._noise.take(6)))
        while self._line and (self._line[0][0] + self._latency_ns <= now or not self.wrench.size):
            self.stamp_ns, self.wrench = self._line.popleft()


class SensorSuite:
    """All sensors but the camera.

    Args:
        scene: Rates, noise, biases and delays.
        vehicle: The vehicle that carries them.
        seed: Same seed, same noise to the bit; each sensor has its own stream.
    """

    def __init__(self, scene: Scene, vehicle: VehicleParams | None = None, seed: int = 0) -> None:
        self.vehicle = vehicle or VehicleParams()
        self.imu, self.force_torque = Imu(scene.imu, seed), ForceTorque(scene.force_torque, seed)

    def sample(self, plant: Plant) -> SensorFrame:
        """What the vehicle delivers at this control tick, without picture or features."""
        self.imu.sample(plant)
        self.force_torque.sample(plant)
        return SensorFrame(
            stamp_ns=plant.time_ns,
            attitude=self.imu.attitude,
            angular_velocity=self.imu.angular_velocity,
            specific_force=self.imu.specific_force,
            wrench=self.force_torque.wrench,
            wrench_stamp_ns=self.force_torque.stamp_ns,
        )
