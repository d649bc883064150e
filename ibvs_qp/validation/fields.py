"""Bounds of every vector and number that enters: one table per type of input.

A vector whose length is within the bound of its entries is accepted by that one comparison; only a longer one is
compared entry by entry. Lines and planes: `ibvs_qp.validation.geometry`.
"""

from __future__ import annotations

import math
from collections.abc import Container
from dataclasses import dataclass
from operator import attrgetter
from typing import Any

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

    def accepts(self, value: Any) -> bool:
        """Whether type, shape, entries and length of a value are as stated; NaN lies within no bounds."""
        if self.size == 0:
            return is_number(value) and self.low <= value <= self.high
        if value is None:
            return self.optional
        if not isinstance(value, np.ndarray) or value.shape != (self.size,) or value.dtype.kind != "f":
            return False
        entries = value.tolist()
        length = math.hypot(*entries)
        if self.unit_length:
            return abs(length * length - 1.0) <= UNIT_TOLERANCE
        return length <= self.high or all([self.low <= entry <= self.high for entry in entries])


class FieldTable:
    """The rows for one type of input.

    Args:
        fields: The rows.

    Attributes:
        fallbacks: Entries in force until an input was accepted, by name.
    """

    def __init__(self, *fields: Field) -> None:
        self._fields = fields
        self._values = attrgetter(*(field.name for field in fields))
        self.fallbacks = {field.name: list(field.fallback) for field in fields if field.fallback}

    def faults(self, source: Any) -> list[Field]:
        """Fields of an input that are refused."""
        return [
            field for field, value in zip(self._fields, self._values(source), strict=True) if not field.accepts(value)
        ]

    def entries(self, source: Any, rejected: Container[str], last: dict[str, list[float]]) -> dict[str, list[float]]:
        """Entries of the fields with a fallback, by name: of an input, and the last ones of rejected fields."""
        return {name: entries if name in rejected else getattr(source, name).tolist() for name, entries in last.items()}


def is_number(value: Any) -> bool:
    """Whether a value is an integer or a float, of Python or numpy."""
    return type(value) is float or isinstance(value, (int, float, np.integer, np.floating))


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
    _vector("trim", 2, 0.6, "rad"),
)


def measurement_table(rotors: int) -> FieldTable:
    """Table for a `Measurement` of a vehicle with that many rotors."""
    return FieldTable(
        _ATTITUDE,
        _ANGULAR_VELOCITY,
        _vector("specific_force", 3, 200.0, "m/s^2", optional=True),
        _vector("contact_wrench", 6, 500.0, "N or N m", fallback=(0.0,) * 6),
        _vector("velocity", 3, 20.0, "m/s", optional=True),
        _vector("acceleration_bias", 3, 5.0, "m/s^2", optional=True),
        _vector("thrust_min", rotors, 1e4, "N", f"not {rotors} finite values", optional=True),
        _vector("thrust_max", rotors, 1e4, "N", f"not {rotors} finite values", optional=True),
    )
