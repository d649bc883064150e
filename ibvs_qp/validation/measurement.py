"""Measurements: every field is checked; a rejected one is named and replaced by its last accepted value."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from ibvs_qp.measurement import Measurement
from ibvs_qp.validation.clock import MonotonicClock, is_stamp
from ibvs_qp.validation.fields import measurement_table
from ibvs_qp.validation.geometry import accepts_line, accepts_plane

#: Largest lead of a sensor's stamp over the tick's [ns].
LEAD_NS = 20_000_000
#: What a refused measurement lacks.
_ALL = ("attitude", "angular_velocity", "specific_force", "contact_wrench", "plane", "lines")


def answered_stamp(measurement: Any) -> int:
    """Stamp of an input of any type, 0 if it has none."""
    stamp = measurement.stamp_ns if isinstance(measurement, Measurement) else None
    return int(stamp) if stamp is not None and is_stamp(stamp) else 0


class MeasurementGate:
    """Checks measurements for a controller; a good one passes unchanged.

    Attributes:
        replaced: Names of the fields that the last measurement lacked.

    Args:
        rotors: Number of rotors, the length of the thrust limits.
    """

    def __init__(self, rotors: int) -> None:
        self._table = measurement_table(rotors)
        self._clock = MonotonicClock()
        self.reset()

    def reset(self) -> None:
        """Forget the accepted values."""
        self._clock.reset()
        self._last = self._table.fallbacks
        self._measured = False
        self._wrench_stamp = 0
        self.replaced: tuple[str, ...] = ()

    @property
    def time_ns(self) -> int:
        """Monotonic time of the last accepted measurement; -1 before the first."""
        return self._clock.last_ns

    @property
    def shift_ns(self) -> int:
        """Added to a stamp to obtain that time."""
        return self._clock.shift_ns

    @property
    def restarted(self) -> bool:
        """Whether the last measurement began a new time base, behind the old one."""
        return self._clock.restarted

    @property
    def inertial(self) -> Measurement | None:
        """Last accepted attitude and rate, for hover without a measurement; None before the first."""
        if not self._measured:
            return None
        return Measurement(
            stamp_ns=self._clock.last_ns - self._clock.shift_ns,
            attitude=np.array(self._last["attitude"]),
            angular_velocity=np.array(self._last["angular_velocity"]),
            contact_wrench=np.array(self._last["contact_wrench"]),
            wrench_stamp_ns=self._wrench_stamp,
        )

    def check(self, measurement: Measurement) -> tuple[Measurement | None, tuple[str, ...]]:
        """The measurement with rejected fields replaced, and what was rejected.

        Returns:
            None for the measurement when its stamp is refused or no attitude was ever accepted.
        """
        self.replaced = _ALL
        if not isinstance(measurement, Measurement):
            return None, ("measurement: not a Measurement",)
        if why := self._clock.accept(measurement.stamp_ns):
            return None, (f"stamp_ns: {why}",)
        rejected: list[str] = []
        changes: dict[str, Any] = {}
        for field in self._table.faults(measurement):
            rejected.append(field.rejection)
            changes[field.name] = np.array(self._last[field.name]) if field.fallback else None
        if "attitude" in changes and not self._measured:
            self._clock.reset()  # time begins with the first attitude
            return None, (rejected[0],)
        stamp = int(measurement.stamp_ns)
        self._check_wrench_stamp(measurement, stamp, rejected, changes)
        _check_plane(measurement, stamp, rejected, changes)
        _check_lines(measurement, rejected, changes)
        _check_limit_order(measurement, rejected, changes)
        self._last = self._table.entries(measurement, changes, self._last)
        self._measured, self.replaced = True, tuple(changes)
        return (dataclasses.replace(measurement, **changes) if changes else measurement), tuple(rejected)

    def _check_wrench_stamp(
        self, measurement: Measurement, stamp: int, rejected: list[str], changes: dict[str, Any]
    ) -> None:
        """A fault of wrench or stamp replaces both: an old wrench with a new stamp would count as a new sample."""
        past = _is_past(measurement.wrench_stamp_ns, stamp)
        if not past:
            rejected.append("wrench_stamp_ns: not a time before the tick")
        if past and "contact_wrench" not in changes:
            self._wrench_stamp = int(measurement.wrench_stamp_ns)
        else:
            changes["contact_wrench"] = np.array(self._last["contact_wrench"])
            changes["wrench_stamp_ns"] = self._wrench_stamp


def _check_plane(measurement: Measurement, stamp: int, rejected: list[str], changes: dict[str, Any]) -> None:
    if measurement.plane is None:
        return
    if not accepts_plane(measurement.plane):
        rejected.append("plane: not 4 finite values with D != 0 in front of the camera")
        changes["plane"] = None
    elif not _is_past(measurement.plane_stamp_ns, stamp):
        rejected.append("plane_stamp_ns: not a time before the tick")
        changes |= {"plane": None, "plane_stamp_ns": 0}


def _check_lines(measurement: Measurement, rejected: list[str], changes: dict[str, Any]) -> None:
    if not isinstance(measurement.lines, tuple):
        rejected.append("lines: not a tuple")
        changes["lines"] = ()
        return
    accepted = tuple([line for line in measurement.lines if accepts_line(line)])
    if faults := len(measurement.lines) - len(accepted):
        rejected.append(f"lines: {faults} not finite or malformed")
        changes["lines"] = accepted


def _check_limit_order(measurement: Measurement, rejected: list[str], changes: dict[str, Any]) -> None:
    low, high = measurement.thrust_min, measurement.thrust_max
    if low is None or high is None or "thrust_min" in changes or "thrust_max" in changes:
        return
    if (low > high).any():
        rejected.append("thrust_max: below thrust_min; raised to it")
        changes["thrust_max"] = np.maximum(low, high)


def _is_past(stamp: Any, tick: int) -> bool:
    return is_stamp(stamp) and stamp <= tick + LEAD_NS
