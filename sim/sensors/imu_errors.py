"""Errors of an IMU beyond its noise: biases, wandering biases, vibration and a tilted attitude estimate."""

from __future__ import annotations

import math

import numpy as np

from ibvs_qp.quaternion import multiply, small_turn
from sim.sensors.vibration import Vibration
from sim.world.errors import AccelerometerErrors, AttitudeErrors, GyroErrors, WorldErrors
from sim.world.random_streams import Normals, stream
from sim.world.slow_noise import SlowNoise, random_direction

#: Correlation times of the wandering biases [s], as identified for an ADIS16448 (IMU plugin of RotorS and of PX4's
#: simulation: kDefaultAdisGyroscopeBiasCorrelationTime, kDefaultAdisAccelerometerBiasCorrelationTime).
GYRO_TIME_S, ACCELEROMETER_TIME_S = 1000.0, 300.0


class _Tilt:
    """Rotation vector of the attitude estimate's error at every sample."""

    def __init__(self, errors: AttitudeErrors, period_s: float, normals: Normals) -> None:
        bias = math.radians(errors.bias_deg) * random_direction(normals, 2)
        self._bias = np.append(bias, 0.0)
        self._wander = SlowNoise(math.radians(errors.wander_deg), errors.wander_time_s, period_s, normals, 2)
        self._sigma, self._normals = math.radians(errors.noise_deg), normals

    def next(self) -> np.ndarray:
        """Error of the next sample in body axes [rad], (3,); the yaw has noise only."""
        vector = self._bias + self._sigma * np.array(self._normals.take(3))
        vector[:2] += self._wander.next()
        return vector


class _Offset:
    """Bias, wandering bias and white noise of one sensor."""

    def __init__(
        self, bias: float, instability: float, time_s: float, density: float, period_s: float, normals: Normals
    ) -> None:
        self._bias = bias * random_direction(normals, 3)
        self._wander = SlowNoise(instability, time_s, period_s, normals, 3)
        self._sigma, self._normals = density / math.sqrt(period_s), normals

    def next(self) -> np.ndarray:
        """Error of the next sample in the sensor's unit, (3,)."""
        return self._bias + self._wander.next() + self._sigma * np.array(self._normals.take(3))


class ImuErrors:
    """Errors of all channels of an IMU; every sensor has a random stream of its own.

    Args:
        errors: Sizes.
        rate_hz: Sample rate [Hz].
        seed: Seed of the flight.
    """

    def __init__(self, errors: WorldErrors, rate_hz: float, seed: int) -> None:
        attitude, gyro, accelerometer = (
            Normals(stream(seed, f"errors.{name}")) for name in ("attitude", "gyro", "accelerometer")
        )
        period_s, turn, felt = 1.0 / rate_hz, errors.gyro, errors.accelerometer
        self._tilt = _Tilt(errors.attitude, period_s, attitude)
        self._gyro = _Offset(turn.bias_rad_s, turn.instability_rad_s, GYRO_TIME_S, turn.density, period_s, gyro)
        self._accelerometer = _Offset(
            felt.bias_m_s2, felt.instability_m_s2, ACCELEROMETER_TIME_S, felt.density, period_s, accelerometer
        )
        sizes = [turn.vibration_rad_s] * 3 + [felt.vibration_m_s2] * 3
        self._vibration = Vibration(sizes, stream(seed, "errors.vibration")) if any(sizes) else None

    @staticmethod
    def present(errors: WorldErrors) -> bool:
        """Whether a world has any error of the IMU."""
        ideal = AttitudeErrors(), GyroErrors(), AccelerometerErrors()
        return (errors.attitude, errors.gyro, errors.accelerometer) != ideal

    def tick(self, now_ns: int, thrusts: np.ndarray) -> None:
        """Advance the vibration to a control tick under the actual thrusts [N], (n,)."""
        if self._vibration is not None:
            self._vibration.tick(now_ns, thrusts)

    def applied(self, sample: np.ndarray) -> np.ndarray:
        """A new sample with the errors: attitude (4), angular velocity (3) [rad/s], specific force (3) [m/s^2]."""
        found = sample.copy()
        found[:4] = multiply(sample[:4].tolist(), small_turn(self._tilt.next().tolist()))
        found[4:7] += self._gyro.next()
        found[7:] += self._accelerometer.next()
        if self._vibration is not None:
            found[4:] += self._vibration.value
        return found
