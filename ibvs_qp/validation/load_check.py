r"""Turn of the force sensor, by the tool's weight and its moment at rest.

At rest the sensor carries the tool: :math:`F_0 = m_t f`, :math:`M_0 = r \times F_0`, with f the specific force and r
the tool's centre of mass from the sensor. A sensor that is turned by R reads :math:`R^T F_0, R^T M_0`. A turn about
:math:`F_0` leaves the force as it is, a turn about :math:`M_0` the moment; both are at right angles, so that a tool
ahead of its sensor shows every turn: in level flight the weight shows turns about x and y, the moment those about x
and z. A tool that hangs below its sensor has no moment: it shows no turn about z.

A zero offset of the size of a reading's error is no turn. So a turn counts from the angle at which it moves force or
moment by more than that error, and a sensor that its driver has zeroed reads nothing that could be checked.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ibvs_qp.config.safety import SafetySettings
from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.frames import GRAVITY

#: Averaging time [s]: within that of the tare, and longer while noise is not small against the allowed errors.
MEAN_TIME, LONGEST_TIME = 0.4, 3.0
#: Standard deviations of a mean that count as its error, and part of the allowed error that is small against it [-].
NOISE_SIGMAS, SMALL_NOISE = 3.0, 0.5
#: At rest the mean specific force has the length of gravity to this error [m/s^2].
REST_FORCE_ERROR = 1.5
#: A load is known by its direction if its length is right to this part [-]: tool mass, gain and cross-talk.
LENGTH_PART = 0.25
#: An error of readings may hide this part of a load [-]; a load that is lighter shows no turn below 30 deg.
LARGEST_PART = 0.5
#: Turn that a sensor in place may show by attitude, gain and cross-talk [deg]: 4 deg in the datasheet world with a
#: heavy tool, whose zero offset hides less; and turn from which it counts.
SHOWN_IN_PLACE_DEG, LEAST_TURN_DEG = 4.0, 6.0
#: A turn is about an axis of the sensor if that is this part of it [-]: within 18 deg.
ONE_AXIS = 0.95
_AXES = dict(zip("xyz", np.eye(3), strict=True))


class LoadCheck:
    """Compares the readings of the force sensor at rest with the load of the tool.

    Attributes:
        done: Whether the readings were compared.
        faults: A turned sensor, in words.
        note: A finding that is no fault: a sensor zeroed by its driver, or with a large zero offset.

    Args:
        vehicle: Tool, and place of the sensor.
        settings: Errors of its readings.
    """

    def __init__(self, vehicle: VehicleParams, settings: SafetySettings) -> None:
        self._mass, self._arm = vehicle.tool_mass_kg, _arm(vehicle)
        self._errors = np.array((settings.force_offset_n, settings.moment_offset_n_m))
        self.reset()

    def reset(self) -> None:
        """As before the first reading."""
        self.done, self.note = False, ""
        self.faults: tuple[str, ...] = ()
        self._begin()

    def _begin(self) -> None:
        self._time, self._force = 0.0, np.zeros(3)
        self._samples, self._stamp = list[np.ndarray](), -1

    def add(self, wrench: np.ndarray, stamp_ns: int, force: Sequence[float], free: bool, dt: float) -> None:
        """Add a tick.

        Args:
            wrench: Force and moment of the tool, vehicle on tool, in axes of B [N, N m], (6,).
            stamp_ns: Time of that sample.
            force: Accelerometer in B [m/s^2], (3,).
            free: Whether the tip is known to be away from the wall.
            dt: Time since the last tick [s].
        """
        if self.done:
            return
        if not free:
            self._begin()
            return
        self._time, self._force = self._time + dt, self._force + dt * np.asarray(force)
        if stamp_ns > self._stamp:
            self._stamp = stamp_ns
            self._samples.append(wrench)
        if self._time < MEAN_TIME:
            return
        samples, specific = np.array(self._samples), self._force / self._time
        spread = np.sqrt(samples.var(axis=0).reshape(2, 3).max(axis=1) / len(samples))
        noise = NOISE_SIGMAS * spread  # of the means of force and moment
        if self._time < LONGEST_TIME and (noise > SMALL_NOISE * self._errors).any():
            return
        if abs(math.hypot(*specific) - GRAVITY) <= REST_FORCE_ERROR:
            self.done = True
            self._compare(samples.mean(axis=0), specific, np.hypot(self._errors, noise))
        self._begin()

    def _compare(self, read: np.ndarray, specific: np.ndarray, errors: np.ndarray) -> None:
        weight = self._mass * specific
        force = _Load(weight, read[:3], float(errors[0]))
        moment = _Load(np.cross(self._arm, weight), read[3:], float(errors[1]))
        known = [load for load in (force, moment) if load.shows_turns and load.has_its_length]
        if any([load.is_turned for load in known]):
            self.faults = (_turn(known),)
        elif force.shows_turns and not force.has_its_length:
            zeroed = force.length <= force.error and moment.length <= moment.tolerance
            why = "zeroed by its driver, a turn is not checkable" if zeroed else "a zero offset, or another tool"
            self.note = f"reads {force.length:.1f} N at rest, the tool weighs {force.size:.1f} N: {why}"


class _Load(NamedTuple):
    """Force or moment of the tool at rest."""

    expected: np.ndarray  # with the sensor's axes as configured, (3,)
    read: np.ndarray  # (3,)
    error: float  # largest error of the reading

    @property
    def size(self) -> float:
        return float(np.linalg.norm(self.expected))

    @property
    def length(self) -> float:
        return float(np.linalg.norm(self.read))

    @property
    def tolerance(self) -> float:
        """Of the length."""
        return max(self.error, LENGTH_PART * self.size)

    @property
    def shows_turns(self) -> bool:
        """Whether it is large enough compared with its error."""
        return self.error <= LARGEST_PART * self.size

    @property
    def has_its_length(self) -> bool:
        """Whether the reading is no more than a turned load."""
        return abs(self.length - self.size) <= self.tolerance

    @property
    def is_turned(self) -> bool:
        """Whether it points farther away than its error moves it, and than that of a sensor in place."""
        cosine = float(self.expected @ self.read) / (self.size * self.length)
        in_place = max(math.asin(self.error / self.size), math.radians(LEAST_TURN_DEG))
        return cosine < math.cos(in_place)


def _arm(vehicle: VehicleParams) -> np.ndarray:
    """Centre of mass of the tool from the sensor, in B [m], (3,)."""
    return np.subtract(vehicle.tool_position_m, vehicle.force_torque_position_m)


def _turn(loads: list[_Load]) -> str:
    """The turn that explains the readings best (Wahba's problem), in words."""
    from scipy.spatial.transform import Rotation  # 0.25 s, and only a refusal needs it

    expected = np.array([load.expected / load.size for load in loads])
    read = np.array([load.read / load.length for load in loads])
    weights = [(load.size / load.error) ** 2 for load in loads]
    turn = Rotation.align_vectors(expected, read, weights)[0].as_rotvec()
    angle = float(np.linalg.norm(turn))
    axis = turn / max(angle, 1e-9)
    largest = int(np.argmax(np.abs(axis)))
    degrees, name = math.degrees(angle), "xyz"[largest]
    if abs(axis[largest]) < ONE_AXIS:
        name = "({:.1f}, {:.1f}, {:.1f})".format(*axis)
    elif axis[largest] < 0.0:
        degrees = -degrees
    return (
        f"force sensor: turned by {degrees:.0f} deg about {name} against the vehicle's settings, "
        "by the tool's weight and moment at rest"
    )


def smallest_turns_deg(vehicle: VehicleParams, settings: SafetySettings) -> dict[str, float]:
    r"""Smallest turn of the force sensor about x, y and z that is found at rest for sure, in level flight [deg].

    A turn by :math:`\varphi` about the unit axis e moves a load L by :math:`2 |e \times L| \sin(\varphi/2)`. It is
    found with certainty when that is twice the error of a reading, of which the zero offset may hide one half, and the
    turn counts relative to the reading of a sensor in place. Infinite where neither weight nor moment shows the turn.
    """
    weight = vehicle.tool_mass_kg * np.array([0.0, 0.0, -GRAVITY])
    found = dict.fromkeys(_AXES, math.inf)
    for load, error in (weight, settings.force_offset_n), (np.cross(_arm(vehicle), weight), settings.moment_offset_n_m):
        for name, axis in _AXES.items() if error <= LARGEST_PART * np.linalg.norm(load) else ():
            moved = float(np.linalg.norm(np.cross(axis, load)))
            if moved > error:
                turn = max(2.0 * math.degrees(math.asin(error / moved)), LEAST_TURN_DEG + SHOWN_IN_PLACE_DEG)
                found[name] = min(found[name], turn)
    return found


def checkable_turns(vehicle: VehicleParams, settings: SafetySettings) -> str:
    """Which turns of the force sensor the start-up check finds, and which it cannot, in one sentence."""
    turns = smallest_turns_deg(vehicle, settings)
    seen = [f"{degrees:.0f} deg about {name}" for name, degrees in turns.items() if math.isfinite(degrees)]
    unseen = [name for name, degrees in turns.items() if math.isinf(degrees)]
    parts = [f"turns from {', '.join(seen)} are found at rest by the tool's weight and moment"] if seen else []
    if unseen:
        parts.append(f"a turn about {' or '.join(unseen)} is not checkable at rest, only by the first push")
    return "force sensor: " + "; ".join(parts)
