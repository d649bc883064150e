"""What an input must be refused for, whatever its bounds: an independent statement of what the checks must name."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from ibvs_qp.estimation.contact_state import ContactState
from ibvs_qp.measurement import FeatureFrame, LineFeature, LineReference, Measurement, Reference, RgbdFrame, SensorFrame

INPUTS = (Measurement, SensorFrame)
_SIZES = {"attitude": 4, "contact_wrench": 6, "wrench": 6, "thrust_min": 6, "thrust_max": 6, "plane": 4}
_INERTIAL = ("attitude", "angular_velocity")
_TARGETS = ("velocity", "travel", "tilt", "trim")
_OPTIONAL = ("specific_force", "velocity", "acceleration_bias", "thrust_min", "thrust_max", "plane")
_OPTIONAL_STAMPS = ("attitude_stamp_ns", "imu_stamp_ns")
#: Lines that are looked at: four for each of two slots.
MOST_LINES = 8


def is_number(value: Any) -> bool:
    """Whether it is a finite real number of Python or numpy."""
    if isinstance(value, bool | np.bool_) or not isinstance(value, int | float | np.integer | np.floating):
        return False
    try:
        return math.isfinite(float(value))
    except OverflowError:
        return False


def is_vector(value: Any, size: int) -> bool:
    """Whether it is a plain array, list or tuple of so many numbers."""
    if type(value) is np.ndarray:
        return value.shape == (size,) and value.dtype.kind in "fiu" and all(map(is_number, value))
    return type(value) in (list, tuple) and len(value) == size and all(map(is_number, value))


def is_stamp(value: Any) -> bool:
    """Whether it is a time at all."""
    return isinstance(value, int | np.integer) and not isinstance(value, bool) and 0 <= value < 2**62


def is_line(line: Any) -> bool:
    """Whether its numbers are numbers, and its role a role."""
    if type(line) not in (LineFeature, LineReference):
        return False
    numbers = [line.rho, line.theta]
    if type(line) is LineFeature:
        numbers.append(line.weight)
        rows = line.covariance
        if (
            type(rows) not in (np.ndarray, list, tuple)
            or len(np.shape(rows) if type(rows) is np.ndarray else rows) != 2
        ):
            return False
        if not all(is_vector(row, 2) for row in rows) or not is_stamp(line.stamp_ns):
            return False
    return all(map(is_number, numbers)) and isinstance(line.role, str) and line.role in ("horizontal", "vertical")


def are_lines(lines: Any) -> bool:
    """Whether all that are looked at are lines."""
    return type(lines) in (list, tuple) and len(lines) <= MOST_LINES and all(map(is_line, lines))


def bad_fields(value: Any, names: tuple[str, ...], size: int = 3) -> Iterator[str]:
    """Names of those vectors that are none."""
    for name in names:
        entry = getattr(value, name)
        if entry is None and name in _OPTIONAL:
            continue
        if not is_vector(entry, _SIZES.get(name, size)):
            yield name


def bad_stamps(value: Any, now: int) -> Iterator[str]:
    """Names of those stamps beside the tick's that are no time or a later one."""
    for name in ("wrench_stamp_ns", *_OPTIONAL_STAMPS):
        stamp = getattr(value, name)
        if not (stamp is None and name in _OPTIONAL_STAMPS) and not (is_stamp(stamp) and stamp <= now + 20_000_000):
            yield name


def in_measurement(value: Any) -> Iterator[str]:
    """What a measurement must be refused for."""
    if not isinstance(value, Measurement):
        yield "measurement"
    elif not is_stamp(value.stamp_ns):
        yield "stamp_ns"
    else:
        yield from bad_fields(value, (*_INERTIAL, "specific_force", "contact_wrench", "velocity", "acceleration_bias"))
        yield from bad_fields(value, ("thrust_min", "thrust_max", "plane"))
        yield from bad_stamps(value, int(value.stamp_ns))
        stamp = value.velocity_stamp_ns
        if value.velocity is not None and stamp is not None and not is_stamp(stamp):
            yield "velocity"
        if not are_lines(value.lines):
            yield "lines"


def in_reference(value: Any) -> Iterator[str]:
    """What a reference must be refused for."""
    if not isinstance(value, Reference):
        yield "reference"
        return
    yield from (f"reference.{name}" for name in ("push_force", "standoff") if not is_number(getattr(value, name)))
    for name in _TARGETS:
        if not is_vector(getattr(value, name), 2):
            yield f"reference.{name}"
    if not isinstance(value.contact, bool | np.bool_):
        yield "reference.contact"
    lines = value.lines
    if type(lines) not in (list, tuple) or not all(map(is_line, lines[:2])):
        yield "reference.lines"
    elif len(lines) > 2:
        yield "reference."  # a refused one is not described further


def in_contact(value: Any) -> Iterator[str]:
    """What a contact must be refused for; True and False count as the numbers that they are."""
    if value is not None and not (isinstance(value, ContactState) and _is_triple(value.normal)):
        yield "contact"


def _is_triple(value: Any) -> bool:
    if type(value) is not tuple or len(value) != 3:
        return False
    return all(isinstance(entry, bool | np.bool_) or is_number(entry) for entry in value)


def in_frame(value: Any) -> Iterator[str]:
    """What a sensor frame must be refused for."""
    if not isinstance(value, SensorFrame):
        yield "sensor frame"
    elif not is_stamp(value.stamp_ns):
        yield "sensor frame: stamp_ns"
    else:
        for name in bad_fields(value, (*_INERTIAL, "specific_force", "wrench")):
            yield f"sensor {name}"
        if value.specific_force is None:
            yield "sensor specific_force"
        for name in bad_stamps(value, int(value.stamp_ns)):
            yield f"sensor {name}"
        yield from _in_pictures(value)


def _in_pictures(frame: SensorFrame) -> Iterator[str]:
    image, seen = frame.image, frame.features
    if image is not None:
        if not isinstance(image, RgbdFrame) or not is_stamp(image.stamp_ns):
            yield "sensor image"
        elif type(image.rgb) is not np.ndarray or type(image.depth) is not np.ndarray:
            yield "image"
    elif seen is not None:
        if not isinstance(seen, FeatureFrame) or not is_stamp(seen.stamp_ns):
            yield "sensor features"
            return
        yield from (f"features.{name}" for name in bad_fields(seen, ("plane",)))
        if not are_lines(seen.lines):
            yield "features.lines"
