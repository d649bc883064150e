"""Attitude of an IMU without orientation: a complementary filter of its gyro and accelerometer."""

from __future__ import annotations

import math

import numpy as np
from scipy.spatial.transform import Rotation

from ibvs_qp.interfaces.ros.messages import BadMessage

#: Gravity, and largest difference of the specific force from it that still shows the vertical [m/s^2].
GRAVITY, CALM = 9.81, 1.0
#: Longest gap between two samples that the gyro bridges [s].
LONGEST_GAP_S = 0.2


class AttitudeFilter:
    r"""Roll and pitch from the accelerometer below a bandwidth, from the gyro above it; yaw from the gyro, from 0 on.

    .. math:: q \leftarrow q \otimes \exp\bigl((\omega + \tfrac{1}{T} (-f/|f|) \times d)\, \Delta t\bigr)

    with the vertical d of the estimate in the body. While the specific force f differs from gravity by more than
    `CALM`, the gyro alone turns the attitude.

    Args:
        time_constant_s: T [s].
    """

    def __init__(self, time_constant_s: float) -> None:
        self._time_constant_s = time_constant_s
        self._stamp_ns, self._attitude = -1, Rotation.identity()

    def update(self, stamp_ns: int, rate: np.ndarray, force: np.ndarray) -> np.ndarray:
        """Attitude of B in I (w, x, y, z) after a sample.

        Args:
            stamp_ns: Its time [ns].
            rate: Angular velocity in B [rad/s], (3,).
            force: Specific force in B [m/s^2], (3,).

        Raises:
            BadMessage: When the filter must begin and the specific force shows no vertical.
        """
        dt, self._stamp_ns, begun = 1e-9 * (stamp_ns - self._stamp_ns), stamp_ns, self._stamp_ns >= 0
        size = float(np.linalg.norm(force))
        calm = abs(size - GRAVITY) <= CALM
        if not (begun and 0.0 < dt <= LONGEST_GAP_S):
            if not calm:
                self._stamp_ns = -1
                raise BadMessage("no vertical to begin the attitude from")
            x, y, z = force
            yaw = float(self._attitude.as_euler("ZYX")[0])
            angles = [yaw, math.atan2(x, math.hypot(y, z)), math.atan2(-y, -z)]
            self._attitude = Rotation.from_euler("ZYX", angles)
        else:
            turn = np.array(rate, float)
            if calm:
                down = self._attitude.inv().apply((0.0, 0.0, 1.0))
                turn += np.cross(-np.asarray(force) / size, down) / self._time_constant_s
            self._attitude = self._attitude * Rotation.from_rotvec(turn * dt)
        x, y, z, w = self._attitude.as_quat()
        return np.array((w, x, y, z))
