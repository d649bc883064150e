"""Errors of a force/torque sensor beyond noise and bias of the scene: calibration, drift, overload, tool mass."""

from __future__ import annotations

import math

import numpy as np

from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.frames import cross
from sim.world.errors import ForceTorqueErrors
from sim.world.random_streams import Normals, stream
from sim.world.readout import PLACES
from sim.world.slow_noise import random_direction

#: Moment over force at full scale [m], which makes cross-talk between both relative: 30 N m and 300 N (Robotiq FT 300).
FULL_SCALE_ARM_M = 0.1
_FELT = PLACES["felt"]
_NS_PER_MIN = 60e9


class WrenchErrors:
    """Reading of a flight's force/torque sensor in place of a wrench.

    Args:
        errors: Sizes.
        vehicle: Nominal mass of the tool; where tool and sensor are.
        seed: Seed of the flight.
    """

    def __init__(self, errors: ForceTorqueErrors, vehicle: VehicleParams, seed: int) -> None:
        normals = self._normals = Normals(stream(seed, "errors.force_torque"))
        scale = np.array([1.0] * 3 + [FULL_SCALE_ARM_M] * 3)
        gains = np.diag(errors.gain * np.array(normals.take(6)))
        cross = errors.cross_talk * np.array(normals.take(36)).reshape(6, 6)
        np.fill_diagonal(cross, 0.0)
        self._calibration = np.eye(6) + gains + scale[:, None] * cross / scale
        self._bias = np.append(errors.bias_n * random_direction(normals, 3), np.zeros(3))
        self._drift = np.append(errors.drift_n_min / _NS_PER_MIN * random_direction(normals, 3), np.zeros(3))
        self._extra_kg = vehicle.tool_mass_kg * errors.tool_mass * normals.take(1)[0]
        self._arm = np.subtract(vehicle.tool_position_m, vehicle.force_torque_position_m).tolist()
        self._sigma = np.array([errors.noise_n] * 3 + [errors.noise_nm] * 3)
        self._limit = np.array([errors.overload_n or math.inf] * 3 + [math.inf] * 3)

    def applied(self, wrench: np.ndarray, truth: np.ndarray, now_ns: int) -> np.ndarray:
        """The reading; the extra mass of the tool is carried like the nominal one, without its turning.

        Args:
            wrench: Reading without these errors, vehicle on tool, FRD [N, N m], (6,).
            truth: `Plant.truth` at the sample.
            now_ns: Time of the sample.
        """
        carried = (self._extra_kg * truth[_FELT]).tolist()
        felt = wrench + np.array((*carried, *cross(self._arm, carried)))
        read = self._calibration @ felt + self._bias + self._drift * now_ns + self._sigma * self._normals.take(6)
        return np.minimum(np.maximum(read, -self._limit), self._limit)
