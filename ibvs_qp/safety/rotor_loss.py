"""What is left when rotors are lost: no level hover any more, so leave the wall, tilted as far as it takes."""

from __future__ import annotations

import math

import numpy as np

from allocation.effectiveness import control_effectiveness
from allocation.least_squares import allocate_least_squares
from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.frames import GRAVITY

#: Lateral force that a level hover may be short of and still count as one [N].
LEVEL_SHORTFALL = 1.0
#: Largest tilt that is asked for [rad]; with the swing around it the vehicle stays within 25 deg.
TILT_BOUND = math.radians(20.0)
#: Fastest change of the wanted tilt [rad/s].
TILT_RATE = math.radians(40.0)
#: Leaving the wall: speed [m/s] and the distance at which it ends [m].
ESCAPE_SPEED, ESCAPE_DISTANCE = 0.6, 1.8
#: Distance error to speed [1/s], velocity error to acceleration [1/s], and bound of that acceleration [m/s^2].
DISTANCE_GAIN, VELOCITY_GAIN, ACCELERATION_BOUND = 1.0, 1.5, 1.2


class Supervisor:
    r"""Watches the thrust limits, and wishes a tilt once no level hover is left.

    With one rotor gone this vehicle has no moment-free wrench that carries it level without a lateral force: 17 N of it
    remain, for four rotors of six towards the wall. Tilted by the angle of the remaining force
    :math:`F = B_F u` that force carries the weight straight up again, and motion comes from tilting, as with any
    multirotor: :math:`\varphi = \varphi_0 + a_{right}/g`, :math:`\theta = \theta_0 - a_n/g`.

    Attributes:
        lost: Whether the limits in force leave no level hover.
    """

    def __init__(self, vehicle: VehicleParams) -> None:
        self._vehicle, self._matrix = vehicle, control_effectiveness(vehicle.geometry)
        self.reset()

    def reset(self) -> None:
        """All rotors as configured."""
        self.lost = False
        self._trim, self._tilt, self._limits = np.zeros(2), np.zeros(2), b""

    def consider(self, limits: tuple[np.ndarray, np.ndarray] | None) -> bool:
        """Look at the limits that the drive reports; True when a level hover has just been lost."""
        if limits is None or (key := np.concatenate(limits).tobytes()) == self._limits:
            return False
        self._limits, before = key, self.lost
        lower = np.minimum(limits[0], limits[1])
        upper = np.maximum(limits[1], lower + 1e-6)
        hover = np.array([0.0, 0.0, -self._vehicle.mass_kg * GRAVITY, 0.0, 0.0, 0.0])
        front, right, down = (self._matrix @ allocate_least_squares(hover, self._matrix, lower, upper))[:3]
        self.lost = math.hypot(front, right) > LEVEL_SHORTFALL
        self._trim = np.array((math.atan2(-right, -down), math.atan2(front, -down))) if self.lost else np.zeros(2)
        return self.lost and not before

    def tilt(self, distance: float, closing: float, along: float, normal: np.ndarray, dt: float) -> np.ndarray:
        """Roll and pitch to fly [rad], (2,): those of the remaining force, and what leads away from the wall.

        Args:
            distance: Centre of mass to wall [m].
            closing: Its speed into the wall [m/s].
            along: Speed to the right along it [m/s].
            normal: Unit vector into the wall, in B, (3,).
            dt: Time since the last call [s].
        """
        leave = min(max(DISTANCE_GAIN * (ESCAPE_DISTANCE - distance), -ESCAPE_SPEED), ESCAPE_SPEED)
        away, back = np.clip(
            (VELOCITY_GAIN * (leave + closing), -VELOCITY_GAIN * along), -ACCELERATION_BOUND, ACCELERATION_BOUND
        )
        x, y = normal[:2] / max(float(np.hypot(normal[0], normal[1])), 1e-6)
        ahead, right = -away * x - back * y, -away * y + back * x
        wanted = self._trim + np.array((right, -ahead)) / GRAVITY
        wanted *= min(1.0, TILT_BOUND / max(float(np.hypot(*wanted)), 1e-9))
        step = TILT_RATE * dt
        self._tilt = self._tilt + np.clip(wanted - self._tilt, -step, step)
        return self._tilt
