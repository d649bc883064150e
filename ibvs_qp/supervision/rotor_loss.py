"""Flight after the loss of rotors: without a level hover the vehicle leaves the wall, tilted."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from allocation import allocate_least_squares, control_effectiveness
from ibvs_qp.config.gains import Gains
from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.estimation.contact_state import ContactState
from ibvs_qp.frames import GRAVITY, roll_pitch

#: Lateral force that a level hover may lack [N]: a third of a degree of tilt replaces it.
LATERAL_SHORTFALL = 0.3
#: Up to this trim [rad] a vehicle is controlled as a level one, forces and yaw included: one rotor stuck or limited
#: near its hover thrust. Beyond it only the tilt moves the vehicle, and yaw is free.
LARGEST_TRIM = math.radians(8.0)
#: A rotor whose limits are closer than this [N] is stuck: no level wrench controls the force in some direction then.
STUCK_WIDTH = 2.0
#: A thrust this near to a limit is at the limit [N]; a singular value below this fraction of the largest is zero [-].
AT_LIMIT, LEAST_VALUE = 0.05, 1e-6
#: Shortest tick of the lead [s].
LEAST_TICK = 1e-3
#: Least distance between lower and upper limit for the allocation [N].
LIMIT_GAP = 1e-6
#: Largest commanded tilt [rad]; with the oscillation around it the vehicle stays within 25 deg (rotor-derate flights).
TILT_BOUND = math.radians(20.0)
#: Fastest change of the commanded tilt [rad/s]: 16 N accelerate the vehicle until it has tilted by 15 deg.
TILT_RATE = math.radians(40.0)
#: Speed away from the wall [m/s] and distance of the centre of mass at which the retreat ends [m].
ESCAPE_SPEED, ESCAPE_DISTANCE = 0.4, 1.7
#: Speed with a rotor that is only limited [m/s].
TRIMMED_SPEED = 0.15
#: Distance error to speed [1/s]; velocity error to acceleration [1/s] and largest commanded acceleration [m/s^2] with
#: a rotor lost: 7 deg of tilt in addition to the trim. A limited one may push to a wall 0.1 m away: faster, and 12 deg.
DISTANCE_GAIN, VELOCITY_GAIN, ACCELERATION_BOUND = 1.0, 1.5, 1.2
TRIMMED_VELOCITY_GAIN, TRIMMED_ACCELERATION_BOUND = 4.0, 2.0
#: A vehicle without a level hover that turned farther from the wall than this turns on: cosine of 20 degrees.
FACING = 0.94
#: Least horizontal part of the wall normal, and least tilt [rad], in divisions.
LEAST_HORIZONTAL, LEAST_TILT = 1e-6, 1e-9


class RotorLoss:
    r"""Detects limits without a level hover, and computes the tilt for them.

    With one rotor lost no wrench of this vehicle carries it level without moments and without a lateral force: 16 N
    remain, for four rotors of six towards the wall. At the tilt of the remaining force :math:`F = B_F u` that force
    points straight up, and motion along it comes from tilting as with any multirotor:
    :math:`\varphi = \varphi_0 + a_{right}/g`, :math:`\theta = \theta_0 - a_n/g`. Across it the force is free. About the
    vertical a moment of 0.9 N m remains: the vehicle turns ever faster, so it descends fast.

    Attributes:
        lost: Whether the present limits leave no hover near level.
        limited: Whether they leave one near level, at an attitude of its own.
        stuck: Whether they leave a rotor one thrust only.

    Args:
        vehicle: The vehicle.
        gains: Of the attitude.
    """

    def __init__(self, vehicle: VehicleParams, gains: Gains | None = None) -> None:
        gains = gains or Gains()
        self._lead_s = gains.attitude_kd / gains.attitude_kp if gains.attitude_kp else 0.0
        self._matrix, self._tip = control_effectiveness(vehicle.geometry), np.array(vehicle.tip_position_m)
        self._hover = np.array([0.0, 0.0, -vehicle.mass_kg * GRAVITY, 0.0, 0.0, 0.0])
        self.reset()

    def reset(self) -> None:
        """All rotors as configured."""
        self.lost = self.limited = self.stuck = False
        self._turned, self._tilting, self._fixed = False, False, np.zeros((2, 2))
        self._trim, self._tilt, self._limits = np.zeros(2), np.zeros(2), b""

    def update(self, limits: tuple[np.ndarray, np.ndarray] | None) -> bool:
        """Evaluate the lower and upper thrust limits [N], (n,) each; None: unchanged.

        Returns:
            Whether the level hover is lost with these limits and was not before.
        """
        if limits is None or (key := np.concatenate(limits).tobytes()) == self._limits:
            return False
        self._limits, before = key, self.lost
        lower = np.minimum(limits[0], limits[1])
        upper = np.maximum(limits[1], lower + LIMIT_GAP)
        thrusts = allocate_least_squares(self._hover, self._matrix, lower, upper)
        front, right, down = (self._matrix @ thrusts)[:3]
        short = math.hypot(front, right) > LATERAL_SHORTFALL
        self._trim = np.array((math.atan2(-right, -down), math.atan2(front, -down))) if short else np.zeros(2)
        self.lost = math.hypot(*self._trim) > LARGEST_TRIM
        self.limited = short and not self.lost
        self.stuck = float(np.min(upper - lower)) < STUCK_WIDTH
        fixed = (upper - lower < STUCK_WIDTH) | (thrusts < lower + AT_LIMIT) | (thrusts > upper - AT_LIMIT)
        self._fixed = _lateral_null_space(self._matrix[:, ~fixed])
        return self.lost and not before

    def turns(self, facing: float) -> bool:
        """Whether it has turned away from the wall, by the cosine of the angle to the normal: it does so for good."""
        self._turned = self.lost and (self._turned or facing < FACING)
        return self._turned

    @property
    def tilts(self) -> bool:
        """Whether the vehicle moves by tilting."""
        return self.lost or self.limited or self.stuck

    def target(
        self, contact: ContactState, attitude: Sequence[float], along: float, dt: float
    ) -> dict[str, np.ndarray]:
        """Commanded roll and pitch [rad], (2,), by its name in a `Reference`; empty for a vehicle that flies level.

        Args:
            contact: Wall and speed towards it.
            attitude: Quaternion B in I: the commanded tilt begins there.
            along: Speed to the right along the wall [m/s].
            dt: Time since the last call [s].
        """
        if not self.tilts:
            self._tilting = False
            return {}
        if not self._tilting:
            self._tilting, self._tilt = True, np.array(roll_pitch(attitude))
        normal = np.array(contact.normal)
        distance = contact.distance + float(normal @ self._tip)
        return {"tilt" if self.lost else "trim": self.tilt(distance, contact.speed, along, normal, dt)}

    def tilt(self, distance: float, closing: float, along: float, normal: np.ndarray, dt: float) -> np.ndarray:
        """Commanded roll and pitch [rad], (2,): the trim of the remaining force plus the retreat from the wall.

        One rotor less leaves one lateral direction in which no force is free; there the vehicle tilts to move. About
        the axis across it the moments are free, and cost no force. The lead makes up for the damping of the attitude,
        which brakes a tilt at any rate.

        Args:
            distance: Centre of mass to wall [m].
            closing: Its speed into the wall [m/s].
            along: Its speed to the right along the wall [m/s].
            normal: Unit vector into the wall, in B, (3,).
            dt: Time since the last call [s].
        """
        fastest, gain, bound = TRIMMED_SPEED, TRIMMED_VELOCITY_GAIN, TRIMMED_ACCELERATION_BOUND
        if self.lost:
            fastest, gain, bound = ESCAPE_SPEED, VELOCITY_GAIN, ACCELERATION_BOUND
        retreat = min(max(DISTANCE_GAIN * (ESCAPE_DISTANCE - distance), -fastest), fastest)
        away, back = np.clip((gain * (retreat + closing), -gain * along), -bound, bound)
        x, y = normal[:2] / max(float(np.hypot(normal[0], normal[1])), LEAST_HORIZONTAL)
        ahead, right = -away * x - back * y, -away * y + back * x
        ahead, right = self._fixed @ (ahead, right)  # across it the rotors' own force moves the vehicle
        target = self._trim + np.array((right, -ahead)) / GRAVITY
        target *= min(1.0, TILT_BOUND / max(float(np.hypot(*target)), LEAST_TILT))
        change = np.clip(target - self._tilt, -TILT_RATE * dt, TILT_RATE * dt)
        self._tilt = self._tilt + change
        return self._tilt + self._lead_s / max(dt, LEAST_TICK) * change


def _lateral_null_space(matrix: np.ndarray) -> np.ndarray:
    """Projection on the lateral directions in which rotors give no force without a moment or a change of lift, (2, 2).

    Args:
        matrix: Their control effectiveness, (6, k).
    """
    left, values, _ = np.linalg.svd(matrix)
    rank = int(np.count_nonzero(values > LEAST_VALUE * values[0])) if values.size else 0
    lateral = left[:2, rank:]
    return lateral @ np.linalg.pinv(lateral, rcond=LEAST_VALUE)
