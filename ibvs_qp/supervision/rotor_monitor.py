"""Rotors that give another thrust than commanded, by the thrust they miss; the tilt after a loss of rotors."""

from __future__ import annotations

import math
import operator
from collections.abc import Sequence

import numpy as np

from allocation import allocate_least_squares, control_effectiveness
from ibvs_qp.config import SafetySettings
from ibvs_qp.config.gains import Gains
from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.estimation.contact_state import ContactState
from ibvs_qp.frames import GRAVITY, roll_pitch
from ibvs_qp.supervision.monitors import Persistence

#: The thrusts that faulty rotors miss must explain all but this fraction of the missing thrust; a push on the body
#: spreads over the rotors.
UNEXPLAINED = 0.5
#: Residual of the fit by faulty rotors over that of the fit by a force through the centre of mass, at most [-]: wind
#: has next to no moment. Equal losses of two opposite rotors fit a force as well; the missing lift finds them.
LESS_THAN_WIND = 0.5
#: Most faulty rotors at once that are distinguished.
MOST_ROTORS = 2
#: A rotor that was found is followed down to this missing thrust [N] and this many standard deviations.
FOUND, FOUND_SIGMAS = 1.5, 3.0
#: A rotor that misses this fraction of its thrust, while the others miss some too, has reached a limit [-].
WEAK = 0.25
#: As many faulty rotors have a common cause, a limit of all: they follow below it, and none gives too much.
COMMON = 3
#: Thrusts of faulty rotors over the highest of them, at least, that have one limit; stopped rotors have none [-].
ONE_LIMIT = 0.5
#: A ceiling with a common cause rises at this rate while no thrust is missing [N/s]: one found while the thrusts change
#: fast is too low to hover with.
RISE_N_S = 2.0
#: Half width of the remaining limits of a stuck rotor [N].
MARGIN = 0.5
#: A single rotor that gives at least this fraction of its thrust is weak, by its blades or its drive: its scale is
#: changed. One that gives less is stuck or lost; so is one that its scale does not explain after so many changes.
LEAST_SCALE, MOST_CHANGES = 0.6, 2
#: Least thrust in a ratio [N].
LEAST_THRUST = 0.5
#: Time after a change of the scale in which motors and filters settle [s]; changes this far apart count as new.
SETTLING_S, FORGOTTEN_S = 0.25, 2.0


class RotorMonitor:
    """Finds rotors by the thrust they miss (`ibvs_qp.estimation.response.missing_thrust`).

    Attributes:
        limits: Lower and upper thrusts of faulty rotors, vehicle limits for the others [N], (n,) each; None while no
            rotor is faulty.
        scale: Thrust of every rotor over that commanded, of weak rotors below 1, (n,).
        note: Last change of the scale in words; empty before the first.

    Args:
        vehicle: Names and limits of the rotors.
        effectiveness: B, (6, n).
        settings: Thresholds.
    """

    def __init__(self, vehicle: VehicleParams, effectiveness: np.ndarray, settings: SafetySettings) -> None:
        self._settings, self._names = settings, vehicle.geometry.names
        self._box = vehicle.thrust_min, vehicle.thrust_max
        # Column i: signature of a missing newton at rotor i; with more than six rotors it spreads over others.
        inverse = np.linalg.pinv(effectiveness)
        self._signatures = inverse @ effectiveness
        # Part that no force through the centre of mass explains.
        self._not_wind = np.eye(len(inverse)) - inverse[:, :3] @ np.linalg.pinv(inverse[:, :3])
        self._lift = Persistence(settings.missing_lift_time_s)
        self._upwards = (-effectiveness[2]).tolist()
        self.reset()

    def reset(self) -> None:
        """All rotors follow."""
        self.limits: tuple[np.ndarray, np.ndarray] | None = None
        self._suspects = dict[int, float]()  # since when [s]
        self._lift.reset()
        self._found: dict[str, float] = {}
        self._strong = set[int]()  # of them those that gave too much
        self._time_s = 0.0
        self.scale, self.note = np.ones(len(self._names)), ""
        self._changes: list[tuple[float, int]] = []  # of the scale: times [s] and rotors

    def update(self, missing: np.ndarray, noise: float, thrusts: np.ndarray, time_s: float) -> str:
        """Rotors that miss thrust, in words.

        Args:
            missing: Missing thrust by the response of the vehicle [N], (n,).
            noise: Its standard deviation while the rotors follow [N].
            thrusts: Thrusts behind the motors' lag by their model, and behind the filter of ``missing`` [N], (n,).
            time_s: Time of the tick [s].
        """
        entries, settings = missing.tolist(), self._settings
        dt, self._time_s = time_s - self._time_s, time_s
        least, sigmas = settings.missing_thrust_n, settings.missing_sigmas
        most = max(max(entries), -min(entries))
        lift = sum(map(operator.mul, self._upwards, entries))
        if most < least and lift <= settings.missing_lift_n and not self._found:  # nearly every tick
            self._suspects.clear()
            self._lift.reset()
            return ""
        if self._found:
            least, sigmas = FOUND, FOUND_SIGMAS
        least = max(least, sigmas * noise)
        if most < least:
            self._suspects.clear()
            self._rise(dt)
        else:
            self._suspect(missing, thrusts, time_s)
        words = [f"{name} gives {thrust:.1f} N" for name, thrust in self._found.items()]
        spread = settings.missing_sigmas * noise * math.sqrt(len(missing))
        # More than the thrust of the rotors cannot be missing: the accelerometer is wrong then.
        given = float(np.dot(self._upwards, thrusts)) + settings.missing_lift_n
        if self._lift.update(max(settings.missing_lift_n, spread) < lift <= given, time_s):
            words.append(f"{lift:.1f} N of lift are missing")
            # Several rotors are weak: no gust, no push at the body. A small fraction of the thrust is a sagging
            # battery.
            for rotor in np.flatnonzero(missing > np.maximum(least, WEAK * thrusts)).tolist():
                loss = float(missing[rotor] / self._signatures[rotor, rotor])
                self._limit(rotor, float(thrusts[rotor]) - loss, loss, stuck=False)
        return ", ".join(words)

    def _suspect(self, missing: np.ndarray, thrusts: np.ndarray, time_s: float) -> None:
        if self._changes and time_s - self._changes[-1][0] < SETTLING_S and self._settles(missing, thrusts):
            self._suspects.clear()
            return
        # While one rotor is followed, its remaining deficit must not be ascribed to a pair.
        rotors = self._explain(missing, 1 if len(self._found) == 1 else MOST_ROTORS)
        self._suspects = {rotor: self._suspects.get(rotor, time_s) for rotor in rotors}
        # A rotor joins those found once it was suspected itself for long enough: while thrusts are shared out anew,
        # others miss some for a tick.
        least = self._settings.missing_time_s
        sure = [
            rotor
            for rotor, since in self._suspects.items()
            if self._names[rotor] in self._found or time_s - since >= least
        ]
        for rotor in sure:
            loss = float(missing[rotor] / self._signatures[rotor, rotor])
            alone = len(sure) == 1 and not self._found
            if not (alone and self._rescale(rotor, loss, float(thrusts[rotor]), time_s)):
                self._limit(rotor, float(thrusts[rotor]) - loss, loss)

    def _settles(self, missing: np.ndarray, thrusts: np.ndarray) -> bool:
        """Whether the rotor whose scale was changed last explains the missing thrust, and has not stopped."""
        rotor = self._changes[-1][1]
        if int(np.argmax(np.abs(missing))) != rotor:
            return False
        given = float(thrusts[rotor] - missing[rotor] / self._signatures[rotor, rotor])
        return given > LEAST_SCALE * float(thrusts[rotor])

    def _rescale(self, rotor: int, loss: float, thrust: float, time_s: float) -> bool:
        """Change the scale of a weak rotor; False for one that is no such.

        ``loss`` is its missing thrust and ``thrust`` that of the motors' model, with the scale of before [N].
        """
        self._changes = [change for change in self._changes if time_s - change[0] < FORGOTTEN_S]
        ratio = (thrust - loss) / max(thrust, LEAST_THRUST)
        scale = min(float(self.scale[rotor]) * ratio, 1.0)
        again = sum(other == rotor for _, other in self._changes) >= MOST_CHANGES
        weak = not again and scale >= LEAST_SCALE and scale != self.scale[rotor]
        if not weak:
            return False
        self.scale = self.scale.copy()
        self.scale[rotor] = scale
        self._changes.append((time_s, rotor))
        self._suspects.clear()
        self.note = f"{self._names[rotor]} gives {100.0 * scale:.0f} % of its thrust"
        return True

    def _explain(self, missing: np.ndarray, most: int) -> Sequence[int]:
        """Fewest rotors, ``most`` at most, whose missing thrusts explain the missing force; empty if they do not."""
        rest, chosen = missing, list[int]()
        most_left = UNEXPLAINED**2 * float(missing @ missing)
        if not self._found:
            left = self._not_wind @ missing
            most_left = min(most_left, LESS_THAN_WIND**2 * float(left @ left))
        while len(chosen) < most:
            chosen.append(int(np.argmax(np.abs(rest))))
            columns = self._signatures[:, chosen]
            rest = missing - columns @ np.linalg.lstsq(columns, missing, rcond=None)[0]
            if float(rest @ rest) < most_left:
                return chosen
        return ()

    def _rise(self, dt: float) -> None:
        """Ceilings with a common cause, one tick later."""
        if self.limits is not None and len(self._found) >= COMMON:
            self.limits = self.limits[0], np.minimum(self.limits[1] + RISE_N_S * dt, self._box[1])

    def _limit(self, rotor: int, actual: float, loss: float, stuck: bool = True) -> None:
        """A faulty rotor counts as stuck at its thrust: one that gives too little may not give less either."""
        # Copies: a log still reads the limits of the ticks before.
        lower, upper = (limit.copy() for limit in self.limits or self._box)
        actual = min(max(actual, 0.0), float(self._box[1][rotor]))
        if stuck:
            lower[rotor] = max(actual - MARGIN, 0.0)
        upper[rotor] = actual if loss > 0.0 else min(actual + MARGIN, float(self._box[1][rotor]))
        self.limits, self._found[self._names[rotor]] = (lower, upper), actual
        (self._strong.add if loss <= 0.0 else self._strong.discard)(rotor)
        if self.scale[rotor] != 1.0:  # the limit explains the thrust that the scale was for
            self.scale = self.scale.copy()
            self.scale[rotor] = 1.0
            self.note = f"{self._names[rotor]}: no scale explains its thrust"
        if len(self._found) >= COMMON:
            # One limit for all: two rotors that keep theirs would leave the others thrusts that they cannot give.
            lower[:], found = self._box[0], [self._names.index(name) for name in self._found]
            if weak := [rotor for rotor in found if rotor not in self._strong]:
                highest = upper[weak].max()
                if upper[weak].min() >= ONE_LIMIT * highest:
                    upper[:] = np.clip(highest, *self._box)


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
