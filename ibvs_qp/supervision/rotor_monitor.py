"""Rotors that give another thrust than commanded, by the thrust they miss."""

from __future__ import annotations

import math
import operator
from collections.abc import Sequence

import numpy as np

from ibvs_qp.config import SafetySettings
from ibvs_qp.config.vehicle import VehicleParams
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
