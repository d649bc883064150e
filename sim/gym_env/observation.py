"""Observation: sensors of the present tick, estimates and references of the last one; nothing of the truth."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from gymnasium import spaces

from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.estimation.line_tracking import SLOTS
from ibvs_qp.measurement import VERTICAL, Measurement, Reference, SensorFrame, channels
from ibvs_qp.pilot import Pilot

_SENSED, _GIVEN = channels(SensorFrame), channels(Reference)
_ATTITUDE, _RATE, _FORCE, _WRENCH = (
    _SENSED[name].high for name in ("attitude", "angular_velocity", "specific_force", "wrench")
)
_PUSH, _TRAVEL, _SPEED = _GIVEN["push_force"].high, _GIVEN["velocity"].high, channels(Measurement)["velocity"].high
_NEAR, _FAR = _GIVEN["standoff"].low, _GIVEN["standoff"].high
#: Largest rho of a line [-], 84 degrees from the optical axis, and largest theta [rad].
_RHO, _THETA = 10.0, 2.0 * math.pi


class _Entry(NamedTuple):
    """Size, bounds and reading of an entry; without bounds it is a flag."""

    size: int
    low: float
    high: float
    read: Callable[[Pilot, SensorFrame], Any]


def _velocity(pilot: Pilot) -> np.ndarray | None:
    return None if pilot.measurement is None else pilot.measurement.velocity


def _flag(read: Callable[[Pilot, SensorFrame], bool]) -> _Entry:
    return _Entry(1, math.nan, math.nan, lambda pilot, frame: [read(pilot, frame)])


#: Entries by name; bounds are those of the channels. Commanded thrusts have the bounds of the vehicle.
_ENTRIES = {
    "attitude_wxyz": _Entry(4, -_ATTITUDE, _ATTITUDE, lambda _, frame: frame.attitude),
    "angular_velocity_rad_s": _Entry(3, -_RATE, _RATE, lambda _, frame: frame.angular_velocity),
    "specific_force_m_s2": _Entry(3, -_FORCE, _FORCE, lambda _, frame: frame.specific_force),
    "force_n": _Entry(3, -_WRENCH, _WRENCH, lambda _, frame: frame.wrench[:3]),
    "moment_n_m": _Entry(3, -_WRENCH, _WRENCH, lambda _, frame: frame.wrench[3:]),
    "velocity_known": _flag(lambda pilot, _: _velocity(pilot) is not None),
    "velocity_m_s": _Entry(3, -_SPEED, _SPEED, lambda pilot, _: np.zeros(3) if (v := _velocity(pilot)) is None else v),
    "wall_known": _flag(lambda pilot, _: pilot.contact.state.known),
    "wall_normal": _Entry(3, -1.0, 1.0, lambda pilot, _: pilot.contact.state.normal),
    "standoff_m": _Entry(1, _NEAR, _FAR, lambda pilot, _: [pilot.contact.state.distance]),
    "in_contact": _flag(lambda pilot, _: pilot.contact.state.in_contact),
    "push_n": _Entry(1, -_PUSH, _PUSH, lambda pilot, _: [pilot.contact.state.push]),
    "reference_contact": _flag(lambda pilot, _: pilot.reference.contact),
    "reference_push_n": _Entry(1, 0.0, _PUSH, lambda pilot, _: [pilot.reference.push_force]),
    "reference_standoff_m": _Entry(1, _NEAR, _FAR, lambda pilot, _: [pilot.reference.standoff]),
    "reference_velocity_m_s": _Entry(2, -_TRAVEL, _TRAVEL, lambda pilot, _: pilot.reference.velocity),
}
#: Entries of every line slot in the order of the columns of `_lines`, with their bounds; none for flags.
_LINES = {
    "line_mask": None,
    "line_vertical": None,
    "line_followed": None,
    "line_weight": (0.0, 1.0),
    "line_rho": (-_RHO, _RHO),
    "line_theta_rad": (-_THETA, _THETA),
    "line_reference_rho": (-_RHO, _RHO),
    "line_reference_theta_rad": (-_THETA, _THETA),
}


def observation_space(vehicle: VehicleParams) -> spaces.Dict:
    """Space of `observe` for a vehicle; entries have their units in their names."""
    bounds = {name: (each.size, each.low, each.high) for name, each in _ENTRIES.items()}
    bounds |= {name: (SLOTS, *(limits or (math.nan, math.nan))) for name, limits in _LINES.items()}
    bounds["thrusts_n"] = vehicle.geometry.count, 0.0, float(np.max(vehicle.thrust_max))
    made: dict[str, spaces.Space] = {
        name: spaces.MultiBinary(size) if math.isnan(low) else spaces.Box(low, high, (size,), np.float32)
        for name, (size, low, high) in bounds.items()
    }
    return spaces.Dict(made)


def observe(space: spaces.Dict, pilot: Pilot, frame: SensorFrame) -> dict[str, np.ndarray]:
    """Observation of a tick before its command, in new arrays.

    Args:
        space: Of `observation_space`; values are clipped to it.
        pilot: The pilot after the last tick.
        frame: Sensors of this tick.
    """
    values = {name: entry.read(pilot, frame) for name, entry in _ENTRIES.items()}
    last = pilot.setpoints.last
    values["thrusts_n"] = np.zeros(pilot.config.controller.vehicle.geometry.count) if last is None else last
    values |= zip(_LINES, _lines(pilot, frame.stamp_ns).T, strict=True)
    found = {}
    for name, each in space.items():
        array = np.array(values[name], each.dtype)
        found[name] = np.minimum(np.maximum(array, each.low), each.high) if isinstance(each, spaces.Box) else array
    return found


def _lines(pilot: Pilot, stamp_ns: int) -> np.ndarray:
    """Tracked lines, each in the slot that it keeps, (SLOTS, numbers); zeros in empty slots."""
    contact, measured, table = pilot.contact.state, pilot.measurement, np.zeros((SLOTS, len(_LINES)))
    if not contact.known or measured is None:
        return table
    # Guides of the strategy and their references are in the same order.
    guides = zip((line.track_id for line in measured.lines), pilot.reference.lines, strict=False)
    targets = {track: (target.rho, target.theta) for track, target in guides}
    for line in pilot.motion.lines.values():
        now = pilot.motion.feature(line, pilot.estimator.axes, contact.distance, stamp_ns)
        flags, target = (1.0, line.role == VERTICAL, line.track_id in targets), targets.get(line.track_id, (0.0, 0.0))
        table[line.slot] = (*flags, now.weight, now.rho, now.theta, *target)
    return table
