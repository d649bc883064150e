"""Raw force/torque samples to the contact wrench at the centre of mass: tool weight, inertia and bias removed."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.estimation.config import EstimationConfig
from ibvs_qp.estimation.tip_force import TipForce
from ibvs_qp.vectors import cross_product


class WrenchTare:
    r"""Contact wrench ON the vehicle from what the vehicle exerts on the tool.

    The tool obeys :math:`m_t f_t = F_{raw} + F_c` with its specific force f_t, so
    :math:`F_c = m_t f_t - F_{raw}`, and likewise for moments about the sensor; the mean in free flight is the bias.
    Of the force across the tool the moments tell more than the force itself (`TipForce`).
    """

    def __init__(self, vehicle: VehicleParams, config: EstimationConfig | None = None) -> None:
        self._config = config or EstimationConfig()
        self._mass = vehicle.tool_mass_kg
        self._sensor = [float(entry) for entry in vehicle.force_torque_position_m]
        self._lever = np.subtract(vehicle.tool_position_m, self._sensor).tolist()
        self._tip = TipForce(vehicle, self._config)
        self.reset()

    def reset(self) -> None:
        """Forget the bias."""
        self._tip.reset()
        self._bias, self._time, self._stamp = [0.0] * 6, 0.0, -1
        self._wrench = np.zeros(6)
        self._force = (0.0, 0.0, -9.81)

    @property
    def ready(self) -> bool:
        """Whether the bias has been averaged long enough."""
        return self._time >= self._config.tare_time_s

    def update(self, raw: np.ndarray, stamp_ns: int, specific_force: Sequence[float], free: bool) -> np.ndarray:
        """Tared contact wrench at the centre of mass [N, N m], (6,).

        Args:
            raw: Sensor sample, FRD axes, vehicle on tool, (6,).
            stamp_ns: Its time.
            specific_force: Accelerometer in B [m/s^2], (3,).
            free: Whether the tip is known to be away from the wall, so that the mean is bias.
        """
        # The accelerometer is noisier than the force sensor needs; average it about as long as a force sample lasts.
        (x, y, z), (fx, fy, fz) = self._force, specific_force
        self._force = x + 0.3 * (fx - x), y + 0.3 * (fy - y), z + 0.3 * (fz - z)
        if stamp_ns <= self._stamp:
            return self._wrench
        rx, ry, rz, rp, rq, rr = numbers = raw.tolist()
        if not math.isfinite(sum(numbers)):
            return self._wrench
        dt = 0.01 if self._stamp < 0 else min((stamp_ns - self._stamp) * 1e-9, 0.1)
        self._stamp = stamp_ns
        x, y, z = self._force
        fx, fy, fz = load = self._mass * x, self._mass * y, self._mass * z
        mx, my, mz = cross_product(self._lever, load)
        contact = fx - rx, fy - ry, fz - rz, mx - rp, my - rq, mz - rr
        if free:
            self._time += dt
            span = min(max(self._time, dt), self._config.tare_follow_s)
            share = min(1.0, dt / span)
            self._bias = [bias + share * (mean - bias) for bias, mean in zip(self._bias, contact, strict=True)]
        fx, fy, fz, mx, my, mz = contact
        bx, by, bz, bp, bq, br = self._bias
        fx, fy, fz, mx, my, mz = fx - bx, fy - by, fz - bz, mx - bp, my - bq, mz - br
        fy, fz = self._tip.across((fx, fy, fz), (mx, my, mz))
        ax, ay, az = cross_product(self._sensor, (fx, fy, fz))
        self._wrench = np.array((fx, fy, fz, mx + ax, my + ay, mz + az))
        return self._wrench
