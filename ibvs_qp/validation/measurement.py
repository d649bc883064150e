"""Measurements and references: each field is checked and copied, and a rejected one keeps its last accepted value."""

from __future__ import annotations

import dataclasses
import math
from operator import gt
from typing import Any

import numpy as np

from ibvs_qp.measurement import LineFeature, Measurement, Reference, channels
from ibvs_qp.validation.clock import NO_PAST_TIME, MonotonicClock, stamp_of
from ibvs_qp.validation.fields import REFERENCE, Entries, field_table, plain_instance
from ibvs_qp.validation.geometry import LINE_BOUND, read_line, read_line_reference, read_lines, read_plane
from ibvs_qp.validation.numbers import matrix

#: Lines looked at for every line that the program has room for: roles and order select among them.
LINES_PER_SLOT = 4
#: Lines and velocities older than this are refused [ns]: the latency of a camera, and some dropped pictures.
OLDEST_LINE_NS = round(1e9 * channels(Measurement)["lines"].oldest_s)
#: Fields that a refused measurement lacks.
_ALL = ("attitude", "angular_velocity", "specific_force", "contact_wrench", "plane", "lines")


def answered_stamp(measurement: Any) -> int:
    """Stamp of an input of any type, 0 if it has none."""
    try:
        stamp = stamp_of(measurement.stamp_ns)
    except Exception:  # an attribute of any other type may raise
        stamp = None
    return 0 if stamp is None else stamp


class MeasurementGate:
    """Checks measurements for a controller; plain ones pass as they are, of others it gets plain copies.

    Only numbers of its own are kept from tick to tick, so that a caller may reuse its arrays.

    Args:
        rotors: Number of rotors, the length of the thrust limits.
        line_slots: Lines that the program has room for.

    Attributes:
        clock: Maps the measurements' stamps to the controller's time.
        replaced: Names of the fields that the last measurement lacked.
    """

    STATE = ("replaced", "_last", "_measured", "_wrench_stamp", "_stamps")

    def __init__(self, rotors: int, line_slots: int) -> None:
        self._table = table = field_table(Measurement, rotors)
        self._inertial_stamps = [name for name in table.optional_stamps if table.stamps[name].held]
        self._most_lines = LINES_PER_SLOT * line_slots
        self.clock = MonotonicClock()
        self.reset()

    def reset(self) -> None:
        """Forget the accepted values."""
        self.clock.reset()
        self._last = self._table.fallbacks
        self._measured = False
        self._wrench_stamp, self._stamps = 0, dict[str, int]()
        self.replaced: tuple[str, ...] = ()

    @property
    def inertial(self) -> Measurement | None:
        """Last accepted attitude and rate, for hover without a measurement; None before the first."""
        if not self._measured:
            return None
        return Measurement(
            stamp_ns=self.clock.last_ns, wrench_stamp_ns=self._wrench_stamp, **self._table.values(self._last)
        )

    def check(self, measurement: Any) -> tuple[Measurement | None, tuple[str, ...]]:
        """The measurement with rejected fields replaced, and the rejections.

        Returns:
            None for the measurement when its stamp is refused or no attitude was ever accepted.
        """
        self.replaced = _ALL
        if not issubclass(type(measurement), Measurement):
            return None, ("measurement: not a Measurement",)
        measurement = plain_instance(measurement, Measurement)
        if why := self.clock.accept(measurement.stamp_ns):
            return None, (f"stamp_ns: {why}",)
        rejected: list[str] = []
        entries, changes, refused = self._table.read(measurement, self._last, rejected)
        self._check_times(measurement, changes, rejected)
        self._check_wrench_time(measurement, refused, entries, changes, rejected)
        self._check_plane(measurement, changes, rejected)
        self._check_lines(measurement, changes, rejected)
        self._check_velocity_time(measurement, changes, rejected)
        _check_covariance(measurement, changes, rejected)
        self._check_limit_order(entries, changes, rejected)
        if "attitude" in refused and not self._measured:
            self.reset()  # time begins with the first attitude
            self.replaced = _ALL
            return None, tuple(rejected)
        self._last, self._measured, self.replaced = entries, True, tuple(refused)
        return (dataclasses.replace(measurement, **changes) if changes else measurement), tuple(rejected)

    def trust(self, measurement: Measurement) -> bool:
        """Accept a measurement whose caller has made and timed its numbers itself, as `Pilot`.

        A second fence: bounds of the vectors, finite lines and plane, the order of time.

        Returns:
            False, and nothing accepted, where `check` might change anything.
        """
        entries, lines, plane = self._table.trusted(measurement), measurement.lines, measurement.plane
        # not finite if one entry is not
        largest = sum([abs(line.rho) + line.covariance.item(0) + line.covariance.item(3) for line in lines])
        if entries is None or not largest <= LINE_BOUND or len(lines) > self._most_lines:
            return False
        if plane is not None and read_plane(plane) is not plane:
            return False
        low, high = entries["thrust_min"], entries["thrust_max"]
        if low is not None and high is not None and any(map(gt, low, high)):
            return False
        if not self._measured or not self.clock.follow(measurement.stamp_ns):
            return False
        self._last, self.replaced, self._wrench_stamp = entries, (), measurement.wrench_stamp_ns
        for name in self._inertial_stamps:
            if (stamp := getattr(measurement, name)) is not None:
                self._stamps[name] = stamp
        return True

    def _check_times(self, measurement: Measurement, changes: dict[str, Any], rejected: list[str]) -> None:
        """Stamp of the tick, and the optional ones of the inertial sensors: None for at the tick."""
        if type(measurement.stamp_ns) is not int or self.clock.shift_ns:
            changes["stamp_ns"] = self.clock.last_ns
        for name in self._inertial_stamps:
            if (stamp := getattr(measurement, name)) is None:
                continue
            if (time := self._check_time(name, stamp, changes, rejected)) is not None:
                self._stamps[name] = time
            else:  # not None: that would count as sampled at the tick
                changes[name] = self._stamps.get(name, 0)

    def _check_time(self, name: str, stamp: Any, changes: dict[str, Any], rejected: list[str]) -> int | None:
        time = self.clock.sample_time(stamp)
        if time is None:
            rejected.append(f"{name}: {NO_PAST_TIME}")
        if time is not stamp:
            changes[name] = time
        return time

    def _check_wrench_time(
        self,
        measurement: Measurement,
        refused: set[str],
        entries: Entries,
        changes: dict[str, Any],
        rejected: list[str],
    ) -> None:
        """A fault of wrench or stamp replaces both: an old wrench with a new stamp would count as a new sample."""
        time = self._check_time("wrench_stamp_ns", measurement.wrench_stamp_ns, changes, rejected)
        if time is not None and "contact_wrench" not in refused:
            self._wrench_stamp = time
            return
        entries["contact_wrench"] = self._last["contact_wrench"]
        changes["contact_wrench"] = np.array(entries["contact_wrench"])
        changes["wrench_stamp_ns"] = self._wrench_stamp

    def _check_limit_order(self, entries: Entries, changes: dict[str, Any], rejected: list[str]) -> None:
        """Limits that contradict each other are a fault of the drive's report: the last ones stay in force."""
        low, high = entries["thrust_min"], entries["thrust_max"]
        if low is None or high is None or not any(map(gt, low, high)):
            return
        rejected.append("thrust_max: below thrust_min; the last limits stay in force")
        for name in ("thrust_min", "thrust_max"):
            entries[name] = self._last[name]
            changes[name] = None if self._last[name] is None else np.array(self._last[name])

    def _check_lines(self, measurement: Measurement, changes: dict[str, Any], rejected: list[str]) -> None:
        """Lines in the controller's time; 0 is no stamp."""
        lines = read_lines(measurement.lines, read_line, self._most_lines, "lines", rejected)
        now = self.clock.last_ns
        sound = [not line.stamp_ns or 0 <= now - line.stamp_ns <= OLDEST_LINE_NS for line in lines]
        if self.clock.shift_ns or not all(sound):
            timed = tuple(line for line in map(self._timed, lines) if line is not None)
            if late := len(lines) - len(timed):
                rejected.append(
                    f"lines: {late} with a stamp_ns over {OLDEST_LINE_NS / 1e6:g} ms old, or {NO_PAST_TIME}"
                )
            lines = timed
        if lines is not measurement.lines:
            changes["lines"] = lines

    def _check_velocity_time(self, measurement: Measurement, changes: dict[str, Any], rejected: list[str]) -> None:
        """Reject a velocity without a valid stamp."""
        stamp = measurement.velocity_stamp_ns
        if stamp is None or measurement.velocity is None:
            return
        if (time := self._recent(stamp)) is None:
            rejected.append(f"velocity_stamp_ns: over {OLDEST_LINE_NS / 1e6:g} ms old, or {NO_PAST_TIME}")
            changes |= {"velocity": None, "velocity_stamp_ns": None}
        elif time is not stamp:
            changes["velocity_stamp_ns"] = time

    def _timed(self, line: LineFeature) -> LineFeature | None:
        """A line in the controller's time; None for one too old or of the future."""
        if line.stamp_ns == 0:
            return line
        time = self._recent(line.stamp_ns)
        if time is None or time == line.stamp_ns:
            return None if time is None else line
        return dataclasses.replace(line, stamp_ns=time)

    def _recent(self, stamp: Any) -> int | None:
        """A stamp in the controller's time; None for one too old or of the future."""
        time = self.clock.sample_time(stamp)
        return None if time is None or self.clock.last_ns - time > OLDEST_LINE_NS else time

    def _check_plane(self, measurement: Measurement, changes: dict[str, Any], rejected: list[str]) -> None:
        if measurement.plane is None:
            return
        plane = read_plane(measurement.plane)
        time = self._check_time("plane_stamp_ns", measurement.plane_stamp_ns, changes, rejected)
        if plane is None:
            rejected.append("plane: not 4 finite values with D != 0 in front of the camera")
        if plane is None or time is None:
            changes |= {"plane": None, "plane_stamp_ns": 0}
        elif plane is not measurement.plane:
            changes["plane"] = plane


def _check_covariance(measurement: Measurement, changes: dict[str, Any], rejected: list[str]) -> None:
    value = measurement.velocity_covariance
    if value is None:
        return
    own = matrix(value, 3)
    if own is None or not math.isfinite(sum(map(sum, own.tolist()))):
        rejected.append("velocity_covariance: not 3 x 3 finite values")
        own = None
    if own is not value:
        changes["velocity_covariance"] = own


class ReferenceGate:
    """Checks references for a controller; of the last accepted one it keeps plain numbers, no array of the caller.

    Args:
        line_slots: Lines that the program has room for; the surplus of a reference is named.
    """

    def __init__(self, line_slots: int) -> None:
        self._room = line_slots
        self.reset()

    def reset(self) -> None:
        """Without a reference the default one is in force."""
        self._last, _, _ = REFERENCE.read(Reference(), REFERENCE.fallbacks, [])
        self._contact, self._lines = False, ()

    @property
    def last(self) -> Reference:
        """The reference in force."""
        return Reference(contact=self._contact, lines=self._lines, **REFERENCE.values(self._last))

    def trust(self, reference: Reference) -> bool:
        """Accept a reference whose caller has made it of checked numbers, as `Pilot`.

        A second fence: bounds of the numbers, finite lines. Types of lines and their fields are not checked.

        Returns:
            False, and nothing accepted, where `check` might change a number.
        """
        entries, lines = REFERENCE.trusted(reference), reference.lines
        largest = sum([abs(line.rho) + abs(line.theta) for line in lines])  # not finite if one entry is not
        if entries is None or not largest <= LINE_BOUND or len(lines) > self._room:
            return False
        self._last, self._contact, self._lines = entries, reference.contact, lines
        return True

    def check(self, reference: Any) -> tuple[Reference, tuple[str, ...]]:
        """The new reference if all of it is accepted, otherwise the last one; and the rejections."""
        if not issubclass(type(reference), Reference):
            return self.last, ("reference: not a Reference",)
        reference, rejected = plain_instance(reference, Reference), []
        entries, changes, _ = REFERENCE.read(reference, self._last, rejected)
        contact, lines, surplus = reference.contact, reference.lines, ()
        if type(contact) not in (bool, np.bool_):
            rejected.append("contact: neither True nor False")
        if type(lines) in (tuple, list) and len(lines) > self._room:
            surplus = (f"reference.lines: {len(lines)} given, room for line_slots = {self._room}",)
            lines = lines[: self._room]
        accepted = read_lines(lines, read_line_reference, self._room, "lines", rejected)
        if rejected:
            return self.last, tuple([f"reference.{reason}" for reason in rejected])
        self._last, self._contact, self._lines = entries, bool(contact), accepted
        plain = not changes and accepted is reference.lines and contact is self._contact
        return reference if plain else self.last, surplus
