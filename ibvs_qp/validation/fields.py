"""Bounds of every vector and number that enters: one table per type of input.

A vector whose length is within the bound of its entries is accepted by that one comparison; only a longer one is
compared entry by entry. Lines and planes: `ibvs_qp.validation.geometry`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from operator import attrgetter
from typing import Any, TypeVar

import numpy as np

from ibvs_qp.frames import GRAVITY
from ibvs_qp.validation.numbers import FLOAT, described, number, vector

Input = TypeVar("Input")

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
        fallback: Entries in force until an input was accepted; empty for None.
        held: Whether the last accepted value stays in force where one is refused; None replaces it otherwise.
        optional: Whether None is accepted.
        unit_length: Whether the vector must have length 1.
    """

    name: str
    size: int
    low: float
    high: float
    unit: str
    fallback: tuple[float, ...] = ()
    held: bool = True
    optional: bool = False
    unit_length: bool = False

    @property
    def accepted_length(self) -> float:
        """A vector of at most this length has all its entries within the bounds."""
        return -1.0 if self.unit_length else min(self.high, -self.low)

    def entries(self, value: Any) -> list[float] | None:
        """Numbers of a value, one for a plain number; None for an invalid one."""
        if self.size == 0:
            only = number(value)
            return None if only is None else [only]
        return vector(value, self.size)

    def accepts(self, entries: list[float]) -> bool:
        """Whether entries, or their length, are as stated; NaN lies within no bounds."""
        if self.unit_length:
            length = math.hypot(*entries)
            return abs(length * length - 1.0) <= UNIT_TOLERANCE
        return all([self.low <= entry <= self.high for entry in entries])

    def value(self, entries: list[float] | None) -> np.ndarray | float | None:
        """The plain value of the entries."""
        if entries is None:
            return None
        return np.array(entries) if self.size else entries[0]

    def rejection(self, value: Any) -> str:
        """Name and reason for `Command.rejected`."""
        if value is None:
            return f"{self.name}: missing"
        if self.entries(value) is None:
            return f"{self.name}: {described(value)}, not {self.size or 'a'} number{'s' * (self.size > 0)}"
        if self.unit_length:
            return f"{self.name}: not a unit quaternion"
        if self.size == 0:
            return f"{self.name}: not within [{self.low:g}, {self.high:g}] {self.unit}"
        return f"{self.name}: not {self.size} finite values within {self.high:g} {self.unit}"


#: Entries of the fields of an input by name, list[float]; None where the input had None.
Entries = dict[str, Any]


class FieldTable:
    """The rows for one type of input.

    Args:
        rows: The rows.

    Attributes:
        rows: The rows.
        fallbacks: Entries in force until an input was accepted, by name.
    """

    def __init__(self, *rows: Field) -> None:
        self.rows = rows
        self._rows = [(row, row.name, (row.size or -1,), row.accepted_length) for row in rows]
        self._values = attrgetter(*(row.name for row in rows))
        self.fallbacks: Entries = {row.name: list(row.fallback) or None for row in rows}

    def read(self, source: Any, last: Entries, rejected: list[str]) -> tuple[Entries, dict[str, Any], set[str]]:
        """Check an input, every attribute of which is read once.

        Args:
            source: The input.
            last: Entries that replace refused ones.
            rejected: Receives the name and reason of every value refused.

        Returns:
            The entries in force; the plain values of converted or replaced ones; and the names of refused ones.
        """
        entries: Entries = {}
        changes: dict[str, Any] = {}
        refused: set[str] = set()
        for (field, name, shape, short), value in zip(self._rows, self._values(source), strict=True):
            if value is None and field.optional:
                entries[name] = None
                continue
            if type(value) is np.ndarray and value.dtype == FLOAT and value.shape == shape:
                own, plain = value.tolist(), True
            elif type(value) is float and field.size == 0:
                own, plain = [value], True
            else:
                own, plain = field.entries(value), False
            if own is None or not (math.hypot(*own) <= short or field.accepts(own)):
                refused.add(name)
                rejected.append(field.rejection(value))
                own, plain = last[name] if field.held else None, False
            if not plain:
                changes[name] = field.value(own)
            entries[name] = own
        return entries, changes, refused

    def values(self, entries: Entries) -> dict[str, Any]:
        """Plain values of all fields."""
        return {field.name: field.value(entries[field.name]) for field, *_ in self._rows}


def plain_instance(source: Any, kind: type[Input]) -> Input:
    """An instance of exactly a type of input: a subclass may compute its attributes, which are read once."""
    if type(source) is kind:
        return source
    values: dict[str, Any] = {field.name: _attribute(source, field.name) for field in fields(kind)}  # type: ignore
    return kind(**values)


class Unreadable:
    """Stands for an attribute that raises when it is read."""


def _attribute(source: Any, name: str) -> Any:
    try:
        return getattr(source, name)
    except Exception:
        return Unreadable()


def _vector(name: str, size: int, bound: float, unit: str, **more: Any) -> Field:
    return Field(name, size, -bound, bound, unit, **more)


_ATTITUDE = _vector("attitude", 4, 1.01, "-", fallback=(1.0, 0.0, 0.0, 0.0), unit_length=True)
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
    _vector("velocity", 2, 20.0, "m/s"),
    _vector("travel", 2, 20.0, "m/s"),
    _vector("tilt", 2, 0.6, "rad"),
    _vector("trim", 2, 0.6, "rad"),
)

#: Targets of a strategy (`ibvs_qp.painting.command.PaintingCommand`).
PAINTING_COMMAND = FieldTable(Field("push", 0, 0.0, 1e3, "N"), *REFERENCE.rows[1:])


def measurement_table(rotors: int) -> FieldTable:
    """Table for a `Measurement` of a vehicle with that many rotors."""
    return FieldTable(
        _ATTITUDE,
        _ANGULAR_VELOCITY,
        _vector("specific_force", 3, 200.0, "m/s^2", optional=True, held=False),
        _vector("contact_wrench", 6, 500.0, "N or N m", fallback=(0.0,) * 6),
        _vector("velocity", 3, 20.0, "m/s", optional=True, held=False),
        _vector("acceleration_bias", 3, 5.0, "m/s^2", optional=True, held=False),
        thrust_limit("thrust_min", rotors),
        thrust_limit("thrust_max", rotors),
    )


def thrust_limit(name: str, rotors: int) -> Field:
    """Row of the lower or upper thrust limits of that many rotors."""
    return _vector(name, rotors, 1e4, "N", optional=True)
