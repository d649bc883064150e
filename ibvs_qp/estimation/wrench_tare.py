"""Raw force/torque samples to the contact wrench at the centre of mass: tool weight, inertia and bias removed."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ibvs_qp.config import EstimationConfig, VehicleParams
from ibvs_qp.estimation.stamps import sample_interval
from ibvs_qp.estimation.tip_force import TipForce
from ibvs_qp.frames import GRAVITY, add_scaled, cross


class WrenchTare:
    r"""Contact wrench ON the vehicle from the wrench that the vehicle exerts on the tool.

    The tool obeys :math:`m_t f_t = F_{raw} + F_c` with its specific force f_t, so
    :math:`F_c = m_t f_t - F_{raw}`, and likewise for moments about the sensor; the mean in free flight is the bias.
    `TipForce` improves the force across the tool by the moments.
    """

    def __init__(self, vehicle: VehicleParams, config: EstimationConfig | None = None) -> None:
        self._config = config or EstimationConfig()
        self._mass = vehicle.tool_mass_kg
        sensor = np.array(vehicle.force_torque_position_m)
        self._sensor, self._tool = sensor.tolist(), (np.array(vehicle.tool_position_m) - sensor).tolist()
        self._tip = TipForce(vehicle, self._config)
        self.reset()

    def reset(self) -> None:
        """Forget the bias."""
        self._tip.reset()
        self._bias, self._time, self._stamp = [0.0] * 6, 0.0, -1
        self._wrench = np.zeros(6)
        self._specific_force = [0.0, 0.0, -GRAVITY]

    @property
    def ready(self) -> bool:
        """Whether the bias has been averaged long enough."""
        return self._time >= self._config.tare_time_s

    def update(self, raw: np.ndarray, stamp_ns: int, specific_force: Sequence[float], free: bool) -> np.ndarray:
        """Tared contact wrench at the centre of mass [N, N m], (6,).

        Args:
            raw: Sensor sample, FRD axes, vehicle on tool, (6,).
            stamp_ns: Its time.
            specific_force: Accelerometer in B [m/s^2], (3,); every tick, also between force samples.
            free: Whether the tip is known to be away from the wall, so that the mean is bias.
        """
        gain, last = self._config.tare_acceleration_gain, self._specific_force
        self._specific_force = [old + gain * (new - old) for old, new in zip(last, specific_force, strict=True)]
        sample = raw.tolist()
        if stamp_ns <= self._stamp or not math.isfinite(sum(sample)):
            return self._wrench
        dt = sample_interval(stamp_ns, self._stamp)
        self._stamp = stamp_ns
        load = [self._mass * entry for entry in self._specific_force]
        contact = [entry - felt for entry, felt in zip((*load, *cross(self._tool, load)), sample, strict=True)]
        if free:
            self._time += dt
            gain = dt / min(max(self._time, dt), self._config.tare_follow_s)
            self._bias = [bias + gain * (entry - bias) for bias, entry in zip(self._bias, contact, strict=True)]
        tared = [entry - bias for entry, bias in zip(contact, self._bias, strict=True)]
        force, moment = tared[:3], tared[3:]
        force[1:] = self._tip.across(force, moment)
        self._wrench = np.array((*force, *add_scaled(moment, 1.0, cross(self._sensor, force))))
        return self._wrench
