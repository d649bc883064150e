"""IMU: gyro, accelerometer and attitude estimate with rate, noise and bias."""

from __future__ import annotations

import functools
import math

import casadi as ca
import numpy as np

from ibvs_qp.quaternion import multiply
from ibvs_qp.symbolic.function import BoundFunction
from sim.sensors.imu_errors import ImuErrors
from sim.sensors.sample_clock import SampleClock
from sim.world.errors import WorldErrors
from sim.world.plant import Plant
from sim.world.random_streams import NormalRows, stream
from sim.world.readout import PLACES, SIZE
from sim.world.scene import ImuScene


class Imu:
    r"""Gyro, accelerometer and the attitude estimate of a flight controller, held between samples.

    White noise of density :math:`\sigma` gives :math:`\sigma \sqrt{rate}` per sample. The attitude estimate is off
    by a constant tilt in a random direction and turned by an arbitrary yaw, both fixed by the seed.

    Args:
        scene: Rate, noise and biases of the scene.
        world: Quaternion of the world in NED, (4,).
        errors: Further errors of the world.
        seed: Seed of the flight.
    """

    def __init__(self, scene: ImuScene, world: np.ndarray, errors: WorldErrors, seed: int) -> None:
        self._clock = SampleClock(scene.rate_hz)
        root = math.sqrt(scene.rate_hz)
        attitude = stream(seed, "attitude")
        direction, yaw = attitude.uniform(-math.pi, math.pi, 2).tolist()
        size = math.radians(scene.attitude_bias_deg)
        tilt = size * math.cos(direction), size * math.sin(direction)
        sigmas = math.radians(scene.attitude_noise_deg), scene.gyro_density * root, scene.accel_density * root
        ned = multiply((math.cos(0.5 * yaw), 0.0, 0.0, math.sin(0.5 * yaw)), world.tolist())
        self._settings = np.array((*sigmas, *tilt, *ned, 1.0))
        self._noise = NormalRows((attitude, stream(seed, "gyro"), stream(seed, "accelerometer")), 3)
        self._kick, self._sample = np.zeros(9), np.zeros(10)
        self._errors = ImuErrors(errors, scene.rate_hz, seed) if ImuErrors.present(errors) else None
        self._plant: Plant | None = None
        self.reading: dict[str, np.ndarray] = {}

    def _bind(self, plant: Plant) -> None:
        self._plant = plant
        self._read = BoundFunction(imu_function(), (plant.truth, self._kick, self._settings), (self._sample,))

    def sample(self, plant: Plant) -> None:
        """Take a sample if one is due."""
        clock, now, errors = self._clock, plant.time_ns, self._errors
        if errors is not None:
            errors.tick(now, plant.motor_thrusts)
        if now < clock.next_ns or not clock.due(now):
            return
        if plant is not self._plant:
            self._bind(plant)
        self._kick[:] = self._noise.take()
        self._read()
        sample = self._sample.copy() if errors is None else errors.applied(self._sample)
        self.reading = {"attitude": sample[:4], "angular_velocity": sample[4:7], "specific_force": sample[7:]}


@functools.cache
def imu_function() -> ca.Function:
    """Function of (readings, nine normal numbers, settings) yielding attitude, angular velocity and specific force."""
    truth, kick, settings = ca.SX.sym("truth", SIZE), ca.SX.sym("kick", 9), ca.SX.sym("settings", 10)
    # The one is a symbol: CasADi folds a literal's division into the products, which rounds differently.
    spread, gyro, accel, tilt_x, tilt_y, *ned, one = (settings[index] for index in range(10))
    quaternion, rate, felt = (truth[PLACES[name]] for name in ("quaternion", "rate", "felt"))
    vector = tilt_x + spread * kick[0], tilt_y + spread * kick[1], spread * kick[2]
    x, y, z = (0.5 * entry for entry in vector)
    length = ca.sqrt(one + x * x + y * y + z * z)
    turn = one / length, x / length, y / length, z / length
    attitude = multiply(ned, multiply([quaternion[index] for index in range(4)], turn))
    sample = ca.vertcat(*attitude, rate + gyro * kick[3:6], felt + accel * kick[6:9])
    return ca.Function("imu", [truth, kick, settings], [ca.densify(sample)])
