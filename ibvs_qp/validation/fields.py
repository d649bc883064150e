"""Bounds of every vector and number that enters: one table per type of input.

`FieldTable.pack` writes the numbers of an input into one list in the order of the table, NaN for a field of wrong type
or shape; one comparison of that list with the bounds accepts them all. Plain Python numbers, because one numpy call
costs more than the arithmetic on vectors this short. Lines and planes: `ibvs_qp.validation.geometry`.
"""

from __future__ import annotations

import math
from collections.abc import Container
from dataclasses import dataclass
from operator import le
from typing import Any, cast

import numpy as np

from ibvs_qp.frames import GRAVITY

#: Largest difference of an attitude's squared length from 1.
UNIT_TOLERANCE = 0.02


@dataclass(frozen=True)
class Field:
    """One row of a table of bounds.

    Attributes:
        name: Attribute of the input.
        size: Entries of its float vector; 0 for a plain number.
        low: Smallest value of an entry.
        high: Largest value of an entry.
        unit: Unit of entries and bounds.
        fallback: Entries in force until an input was accepted; empty where the caller replaces a rejected value.
        optional: Whether None is accepted.
        unit_length: Whether the vector must have length 1.
        fault: Reason for `Command.rejected`; empty for size and bounds.
    """

    name: str
    size: int
    low: float
    high: float
    unit: str
    fallback: tuple[float, ...] = ()
    optional: bool = False
    unit_length: bool = False
    fault: str = ""

    @property
    def rejection(self) -> str:
        """Name and reason for `Command.rejected`."""
        within = f"{self.high} {self.unit}" if self.size else f"[{self.low:g}, {self.high:g}] {self.unit}"
        count = f"{self.size} finite values " if self.size else ""
        return f"{self.name}: " + (self.fault or f"not {count}within {within}")

    def numbers(self, value: Any) -> list[float]:
        """Entries of a value; NaN if it has the wrong type or shape, 0 for an accepted None."""
        if self.size == 0:
            return [cast(float, value) if is_number(value) else math.nan]
        if isinstance(value, np.ndarray) and value.shape == (self.size,) and value.dtype.kind == "f":
            return value.tolist()
        return [0.0 if value is None and self.optional else math.nan] * self.size

    def accepts(self, numbers: list[float]) -> bool:
        """Whether all entries lie within the bounds; NaN lies within none."""
        return all(self.low <= number <= self.high for number in numbers) and self.accepts_length(numbers)

    def accepts_length(self, numbers: list[float]) -> bool:
        """Whether the vector has length 1, where it must."""
        return not self.unit_length or abs(sum([number * number for number in numbers]) - 1.0) <= UNIT_TOLERANCE


class FieldTable:
    """The rows for one type of input.

    Args:
        fields: Rows in the order in which they are packed.

    Attributes:
        part: Place of a field in the packed list, by name.
        fallbacks: Entries in force until an input was accepted, by name.
    """

    def __init__(self, *fields: Field) -> None:
        self._fields = fields
        self._low, self._high = [], []
        self.part: dict[str, slice] = {}
        for field in fields:
            entries = field.size or 1
            self.part[field.name] = slice(len(self._low), len(self._low) + entries)
            self._low += [field.low] * entries
            self._high += [field.high] * entries
        self._unit = [(field, self.part[field.name]) for field in fields if field.unit_length]
        self.fallbacks = {field.name: list(field.fallback) for field in fields if field.fallback}

    def pack(self, source: Any) -> list[float]:
        """Numbers of all fields of an input in one list."""
        packed: list[float] = []
        for field in self._fields:
            packed += field.numbers(getattr(source, field.name))
        return packed

    def faults(self, packed: list[float]) -> list[Field]:
        """Fields whose packed numbers are refused: field by field only if the comparison of the whole list fails."""
        within = all(map(le, self._low, packed)) and all(map(le, packed, self._high))
        if within and all([field.accepts_length(packed[part]) for field, part in self._unit]):
            return []
        return [field for field in self._fields if not field.accepts(packed[self.part[field.name]])]

    def updated(
        self, last: dict[str, list[float]], packed: list[float], rejected: Container[str]
    ) -> dict[str, list[float]]:
        """Last accepted entries by name after an input some of whose fields were rejected."""
        return {name: old if name in rejected else packed[self.part[name]] for name, old in last.items()}


def is_number(value: Any) -> bool:
    """Whether a value is an integer or a float, of Python or numpy."""
    return isinstance(value, (int, float, np.integer, np.floating))


def _vector(name: str, size: int, bound: float, unit: str, fault: str = "", **more: Any) -> Field:
    return Field(name, size, -bound, bound, unit, fault=fault, **more)


_ATTITUDE = _vector("attitude", 4, 1.01, "-", "not a unit quaternion", fallback=(1.0, 0.0, 0.0, 0.0), unit_length=True)
_ANGULAR_VELOCITY = _vector("angular_velocity", 3, 35.0, "rad/s", fallback=(0.0,) * 3)

#: Raw sensors (`SensorFrame`).
SENSOR_FRAME = FieldTable(
    _ATTITUDE,
    _ANGULAR_VELOCITY,
    _vector("specific_force", 3, 200.0, "m/s^2", fallback=(0.0, 0.0, -GRAVITY)),
    _vector("wrench", 6, 500.0, "N or N m", fallback=(0.0,) * 6),
)

#: Targets of a controller (`Reference`): a fault rejects the whole reference.
REFERENCE = FieldTable(
    Field("push_force", 0, 0.0, 1e3, "N"),
    Field("standoff", 0, -1.0, 10.0, "m"),
    _vector("velocity", 2, 20.0, "m/s", "not 2 finite values"),
    _vector("travel", 2, 20.0, "m/s", "not 2 finite values"),
    _vector("tilt", 2, 0.6, "rad"),
)


def measurement_table(rotors: int) -> FieldTable:
    """Table for a `Measurement` of a vehicle with that many rotors."""
    return FieldTable(
        _ATTITUDE,
        _ANGULAR_VELOCITY,
        _vector("specific_force", 3, 200.0, "m/s^2", optional=True),
        _vector("contact_wrench", 6, 500.0, "N or N m", fallback=(0.0,) * 6),
        _vector("velocity", 3, 20.0, "m/s", optional=True),
        _vector("thrust_min", rotors, 1e4, "N", f"not {rotors} finite values", optional=True),
        _vector("thrust_max", rotors, 1e4, "N", f"not {rotors} finite values", optional=True),
    )
