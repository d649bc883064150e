"""Bounds of every vector and number that enters: one table per type of input, of its channels.

A vector whose length is within the bound of its entries is accepted by that one comparison; only a longer one is
compared entry by entry. Lines and planes: `ibvs_qp.validation.geometry`.
"""

from __future__ import annotations

import math
from dataclasses import fields, replace
from operator import attrgetter
from typing import Any, TypeVar

import numpy as np

from ibvs_qp.measurement import ROTORS, Channel, FeatureFrame, Reference, SensorFrame, channels
from ibvs_qp.validation.numbers import FLOAT, described, number, vector

Input = TypeVar("Input")

#: Largest difference of an attitude's squared length from 1.
UNIT_TOLERANCE = 0.02
#: Shape of no array.
_NO_ARRAY = (-1,)


class Field(Channel):
    """One row of a table of bounds: the channel of an attribute of the input, and the bounds of its values."""

    @property
    def accepted_length(self) -> float:
        """A vector of at most this length has all its entries within the bounds."""
        return -1.0 if self.unit_length else min(self.high, -self.low)

    def entries(self, value: Any) -> list[float] | None:
        """Numbers of a value, one for a plain number; None if it is no such value."""
        if not self.shape:
            only = number(value)
            return None if only is None else [only]
        return vector(value, self.shape[0])

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
        return np.array(entries) if self.shape else entries[0]

    def rejection(self, value: Any) -> str:
        """Name and reason for `Command.rejected`."""
        if value is None:
            return f"{self.name}: missing"
        if self.entries(value) is None:
            (size,) = self.shape or (0,)
            return f"{self.name}: {described(value)}, not {size or 'a'} number{'s' * (size > 0)}"
        if self.unit_length:
            return f"{self.name}: not a unit quaternion"
        if not self.shape:
            return f"{self.name}: not within [{self.low:g}, {self.high:g}] {self.unit}"
        return f"{self.name}: not {self.shape[0]} finite values within {self.high:g} {self.unit}"


#: Entries of the fields of an input by name, list[float]; None where the input had None.
Entries = dict[str, Any]


class FieldTable:
    """The rows for one type of input.

    Args:
        rows: The rows.
        optional_stamps: Stamps of samples that may be None.

    Attributes:
        rows: The rows.
        fallbacks: Entries in force until an input was accepted, by name.
        stamps: The first row of every field with the time of a sample.
        optional_stamps: Those that may be None: at the tick.
    """

    def __init__(self, *rows: Field, optional_stamps: tuple[str, ...] = ()) -> None:
        self.rows, self.optional_stamps = rows, optional_stamps
        self._rows = [(row, row.name, row.shape or _NO_ARRAY, row.accepted_length) for row in rows]
        self._values = attrgetter(*(row.name for row in rows))
        self.fallbacks: Entries = {row.name: list(row.fallback) or None for row in rows}
        self.stamps = {row.stamp: row for row in reversed(rows) if row.stamp}

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
            elif type(value) is float and not field.shape:
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

    def trusted(self, source: Any) -> Entries | None:
        """Entries of an input whose values are plain; None where one is not within its bounds."""
        entries: Entries = {}
        for (field, name, _, short), value in zip(self._rows, self._values(source), strict=True):
            own = value if value is None else value.tolist() if field.shape else [value]
            if not (field.optional if own is None else math.hypot(*own) <= short or field.accepts(own)):
                return None
            entries[name] = own
        return entries

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


def field_table(kind: type, rotors: int = 0) -> FieldTable:
    """Rows of all channels of a type of input that have bounds, for a vehicle with that many rotors."""
    rows = [Field(**vars(each)) for each in channels(kind).values() if each.high < math.inf]
    rows = [replace(row, shape=(rotors,)) if row.shape == (ROTORS,) else row for row in rows]
    stamps = {row.stamp for row in rows}
    optional = [each.name for each in fields(kind) if each.name in stamps and each.default is None]
    return FieldTable(*rows, optional_stamps=tuple(optional))


#: Raw sensors; and the velocity of a picture.
SENSOR_FRAME, FEATURE_FRAME = field_table(SensorFrame), field_table(FeatureFrame)
#: Targets of a controller: a fault rejects the whole reference.
REFERENCE = field_table(Reference)
#: Targets of a strategy (`ibvs_qp.pilot.painting.command.PaintingCommand`).
PAINTING_COMMAND = FieldTable(replace(REFERENCE.rows[0], name="push"), *REFERENCE.rows[1:])
