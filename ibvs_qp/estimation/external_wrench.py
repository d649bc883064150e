"""What pushes the vehicle beside its rotors, gravity and the felt contact: wrong mass, shifted centre, wind."""

from __future__ import annotations

import math

import numpy as np

from ibvs_qp.frames import cross
from ibvs_qp.vehicle import VehicleParams

#: Bandwidth of the force observer in free flight and in contact [rad/s].
FORCE_BANDWIDTH_FREE, FORCE_BANDWIDTH_CONTACT = 4.0, 1.5
#: Bandwidth of the moment observer [rad/s]; below the attitude loop so that the two do not fight.
MOMENT_BANDWIDTH = 2.5
#: The force observer averages evenly over this time at the start, then turns to its bandwidth [s].
START_TIME = 0.25
#: Largest believable external force and moment [N], [N m]; beyond it is a fault, not a load.
FORCE_BOUND, MOMENT_BOUND = 40.0, 6.0


class ExternalWrench:
    r"""Momentum and accelerometer observer of the unmodelled wrench at the centre of mass.

    Force: :math:`m f_{spec} - B_F \hat u - F_c`, low-passed, with the lagged thrusts :math:`\hat u` and the measured
    contact force F_c. Moment: first-order momentum observer of
    :math:`J\dot\Omega + \Omega\times J\Omega - B_M \hat u - M_{ff}` (De Luca and Mattone, 2003, without joint axes).
    In contact the component along the wall normal is frozen: it belongs to the force task.
    """

    def __init__(self, vehicle: VehicleParams, effectiveness: np.ndarray) -> None:
        self._vehicle, self._effectiveness = vehicle, effectiveness
        self._inertia = np.array(vehicle.inertia_kg_m2)
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self.force, self.moment = np.zeros(3), np.zeros(3)
        self.thrusts: np.ndarray | None = None
        self._time = 0.0
        self._share_dt = -1.0
        self._integral: np.ndarray | None = None

    def follow(self, command: np.ndarray, dt: float) -> None:
        """Advance the lag model of the motors towards the commanded thrusts."""
        if self.thrusts is None:
            self.thrusts = command.copy()
            return
        if dt != self._share_dt:
            vehicle, self._share_dt = self._vehicle, dt
            self._share_up = 1.0 - math.exp(-dt / vehicle.motor_lag_up_s)
            self._share_down = 1.0 - math.exp(-dt / vehicle.motor_lag_down_s)
        step = command - self.thrusts
        self.thrusts = self.thrusts + np.where(step > 0.0, self._share_up, self._share_down) * step

    def update(
        self,
        specific_force: np.ndarray | None,
        omega: np.ndarray,
        contact_wrench: np.ndarray,
        fed_forward_moment: np.ndarray,
        normal: np.ndarray,
        in_contact: bool,
        adapt_in_contact: bool,
        dt: float,
    ) -> None:
        """Take in one tick; does nothing before the first command."""
        if self.thrusts is None or dt <= 0.0:
            return
        self._time += dt
        rotor_wrench = self._effectiveness @ self.thrusts
        if in_contact and not adapt_in_contact:
            self._integral = None
            return
        self._update_moment(omega, rotor_wrench[3:] + fed_forward_moment, dt)
        if specific_force is None:
            return
        bandwidth, (nx, ny, nz) = FORCE_BANDWIDTH_FREE, normal.tolist()
        mass, old = self._vehicle.mass_kg, self.force.tolist()
        felt = zip(specific_force.tolist(), rotor_wrench.tolist(), old, strict=False)
        x, y, z = (mass * force - rotor - known for force, rotor, known in felt)
        if in_contact:
            cx, cy, cz, *_ = contact_wrench.tolist()
            x, y, z = x - cx, y - cy, z - cz
            along = nx * x + ny * y + nz * z
            x, y, z = x - along * nx, y - along * ny, z - along * nz
            bandwidth = FORCE_BANDWIDTH_CONTACT
        share = max(1.0 - math.exp(-bandwidth * dt), dt / self._time if self._time < START_TIME else 0.0)
        moved = (value + share * step for value, step in zip(old, (x, y, z), strict=True))
        self.force = np.array([min(max(value, -FORCE_BOUND), FORCE_BOUND) for value in moved])

    def _update_moment(self, omega: np.ndarray, known_moment: np.ndarray, dt: float) -> None:
        momentum = self._inertia * omega
        gyroscopic = cross(omega, momentum)
        if self._integral is None:
            self._integral = momentum - self.moment / MOMENT_BANDWIDTH
        self._integral = self._integral + dt * (known_moment - gyroscopic + self.moment)
        moment = MOMENT_BANDWIDTH * (momentum - self._integral)
        self.moment = np.minimum(np.maximum(moment, -MOMENT_BOUND), MOMENT_BOUND)

    @property
    def wrench(self) -> np.ndarray:
        """Force and moment [N, N m], (6,)."""
        return np.concatenate((self.force, self.moment))
