"""What may enter a controller: every field is checked, what fails is named and replaced by the last good value."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np

from ibvs_qp.measurement import LineFeature, Measurement, Reference

#: Largest believable norms: body rate [rad/s], specific force [m/s^2], wrench [N, N m] and velocity [m/s].
RATE_BOUND, ACCELERATION_BOUND, WRENCH_BOUND, VELOCITY_BOUND = 35.0, 200.0, 500.0, 20.0


def _vector(value: Any, size: int, bound: float) -> bool:
    return (
        isinstance(value, np.ndarray)
        and value.shape == (size,)
        and value.dtype.kind == "f"
        and bool(value @ value <= bound * bound)  # False for NaN too
    )


class MeasurementGate:
    """Passes good measurements on untouched, mends bad ones, and says what it refused."""

    def __init__(self, rotors: int) -> None:
        self._rotors = rotors
        self.reset()

    def reset(self) -> None:
        """Forget the last good values."""
        self._attitude: np.ndarray | None = None
        self._omega = np.zeros(3)
        self._wrench, self._wrench_stamp = np.zeros(6), 0
        self._stamp: int | None = None

    def check(self, measurement: Measurement) -> tuple[Measurement | None, tuple[str, ...]]:
        """A measurement that is safe to use, or None when not even an attitude is known, and what was refused."""
        changes: dict[str, Any] = {}
        rejected: list[str] = []

        def refuse(name: str, why: str, value: Any) -> None:
            rejected.append(f"{name}: {why}")
            changes[name] = value

        stamp = measurement.stamp_ns
        if not isinstance(stamp, (int, np.integer)) or (self._stamp is not None and stamp <= self._stamp):
            rejected.append("stamp_ns: not after the last one")
            return None, tuple(rejected)
        attitude = measurement.attitude
        if not _vector(attitude, 4, 1.01) or abs(float(attitude @ attitude) - 1.0) > 0.02:
            if self._attitude is None:
                rejected.append("attitude: not a unit quaternion")
                return None, tuple(rejected)
            refuse("attitude", "not a unit quaternion", self._attitude)
        else:
            self._attitude = attitude
        if _vector(measurement.angular_velocity, 3, RATE_BOUND):
            self._omega = measurement.angular_velocity
        else:
            refuse("angular_velocity", f"not 3 finite values within {RATE_BOUND} rad/s", self._omega)
        if measurement.specific_force is not None and not _vector(measurement.specific_force, 3, ACCELERATION_BOUND):
            refuse("specific_force", f"not 3 finite values within {ACCELERATION_BOUND} m/s^2", None)
        if _vector(measurement.contact_wrench, 6, WRENCH_BOUND) and isinstance(
            measurement.wrench_stamp_ns, (int, np.integer)
        ):
            self._wrench, self._wrench_stamp = measurement.contact_wrench, measurement.wrench_stamp_ns
        else:
            refuse("contact_wrench", f"not 6 finite values within {WRENCH_BOUND} N or N m", self._wrench)
            changes["wrench_stamp_ns"] = self._wrench_stamp
        if measurement.plane is not None and not _good_plane(measurement.plane):
            refuse("plane", "not 4 finite values with D != 0 in front of the camera", None)
        if measurement.velocity is not None and not _vector(measurement.velocity, 3, VELOCITY_BOUND):
            refuse("velocity", f"not 3 finite values within {VELOCITY_BOUND} m/s", None)
        self._check_lines(measurement, refuse)
        self._check_limits(measurement, refuse)
        self._stamp = int(stamp)
        return (dataclasses.replace(measurement, **changes) if changes else measurement), tuple(rejected)

    def _check_lines(self, measurement: Measurement, refuse: Any) -> None:
        if not isinstance(measurement.lines, tuple):
            refuse("lines", "not a tuple", ())
            return
        good = tuple(line for line in measurement.lines if _good_line(line))
        if len(good) != len(measurement.lines):
            refuse("lines", f"{len(measurement.lines) - len(good)} not finite", good)

    def _check_limits(self, measurement: Measurement, refuse: Any) -> None:
        for name in ("thrust_min", "thrust_max"):
            value = getattr(measurement, name)
            if value is not None and not _vector(value, self._rotors, 1e4):
                refuse(name, f"not {self._rotors} finite values", None)


def _good_plane(plane: Any) -> bool:
    try:
        a, b, c, d = (float(entry) for entry in plane)
    except (TypeError, ValueError):
        return False
    return math.isfinite(a + b + c + d) and d != 0.0 and -c / d > 0.05


def _good_line(line: Any) -> bool:
    if not isinstance(line, LineFeature) or line.role not in ("horizontal", "vertical"):
        return False
    try:
        numbers = float(line.rho) + float(line.theta) + float(line.weight)
        covariance = line.covariance is not None and bool(np.isfinite(line.covariance).all())
    except (TypeError, ValueError):
        return False
    return math.isfinite(numbers) and covariance and np.shape(line.covariance) == (2, 2) and 0 <= line.weight <= 1


def check_reference(reference: Reference, last: Reference) -> tuple[Reference, tuple[str, ...]]:
    """The reference if it is sound, else the last sound one and the names of what was refused."""
    rejected = []
    try:
        if not 0.0 <= float(reference.push_force) < 1e3:
            rejected.append("reference.push_force: not within [0, 1000] N")
        if not -1.0 < float(reference.standoff) < 10.0:
            rejected.append("reference.standoff: not within [-1, 10] m")
        if not _vector(reference.velocity, 2, VELOCITY_BOUND):
            rejected.append("reference.velocity: not 2 finite values")
        for line in reference.lines:
            if not math.isfinite(line.rho + line.theta) or line.role not in ("horizontal", "vertical"):
                rejected.append("reference.lines: not finite or of unknown role")
    except (TypeError, AttributeError, ValueError):
        rejected.append("reference: malformed")
    return (last, tuple(rejected)) if rejected else (reference, ())
