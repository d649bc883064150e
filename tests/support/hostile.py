"""Hostile inputs by mutation of recorded good ones: cheap, reproducible by a seed, nested to any depth."""

from __future__ import annotations

import dataclasses
import math
import random
from typing import Any

import numpy as np

from ibvs_qp.measurement import LineFeature, Measurement, Reference


class Raising:
    """Raises at whatever is done with it."""

    def _raise(self, *_: Any) -> Any:
        raise RuntimeError("hostile")

    __array__ = __bool__ = __float__ = __index__ = __int__ = __iter__ = __len__ = __getitem__ = _raise
    __eq__ = __lt__ = __le__ = __gt__ = __ge__ = __neg__ = __abs__ = __add__ = __mul__ = __str__ = _raise  # type: ignore[assignment]
    __hash__ = None  # type: ignore[assignment]


class Unit(np.ndarray):
    """Numbers in a unit of their own, as of a library of quantities."""


class Text(str):
    """A text that no dictionary takes."""

    __hash__ = None  # type: ignore[assignment]


class Count(int):
    """A number of a type of its own."""


def _frozen(values: list[Any]) -> list[Any]:
    """The values; arrays among them cannot be written, so that a step that writes into its inputs raises."""
    for value in values:
        if isinstance(value, np.ndarray) and value is not np.ma.masked:
            value.flags.writeable = False
    return values


OBJECTS = np.frompyfunc(lambda _: Raising(), 1, 1)(np.zeros(6))  # no other way to put them into an array
NESTED: list[Any] = []
for _ in range(1000):
    NESTED = [NESTED]

#: Numbers that are refused in every field.
REFUSED_NUMBERS: list[Any] = [
    *(math.nan, math.inf, -math.inf, 1e300, -1e300, 1.7e308, 10**400, -(10**400), 2**1000, 1j),
    *(np.float32(math.nan), np.float64(math.inf), np.longdouble("1e4000")),
]
#: Numbers that some fields accept: lies.
ODD_NUMBERS: list[Any] = [0.0, -0.0, 1e-320, -1.0, 1.0, 0.5, 7.0, 1e-9, 1e3, np.float16(0.1), Count(3), np.int8(-1)]
#: Things that are no numbers, or not as many as any field has.
THINGS: list[Any] = _frozen(
    [
        *(None, True, False, "", "x", "0.5", b"\0", Text("horizontal"), (), [], {}, set(), object(), Raising()),
        *(NESTED, [None] * 3, ["a"] * 4, [[0.0] * 3] * 3, ([1.0], [2.0]), iter(()), range(3), len, Ellipsis, Raising),
        *(np.zeros(0), np.zeros(5), np.zeros((3, 1)), np.zeros((2, 2, 2)), np.array(3.0), np.array("x")),
        *(np.full(3, math.nan), np.full(4, math.nan), np.full(6, math.inf), np.full((2, 2), math.nan)),
        *(np.full(2, 1e300), np.array([None] * 3), OBJECTS, np.ma.masked, np.ma.masked_all(3), np.ma.masked_all(6)),
        *(np.zeros(3).view(Unit), np.zeros(6).view(Unit), np.zeros(3, complex), np.zeros(3, "U5"), np.bool_(True)),
        *(np.zeros(3, "M8[ns]"), np.zeros(3, [("x", float)]), np.datetime64(0, "s"), np.broadcast_to(0.0, (10**9,))),
        *(np.broadcast_to(0.0, (3, 10**9)), [0.0] * 10**4, LineFeature, Measurement, Reference(), memoryview(b"abc")),
        *(slice(3), NotImplemented),
    ]
)
_SIZES = (2, 3, 4, 6)
#: Vectors of every size that some fields accept: lies.
ODD_VECTORS: list[Any] = _frozen(
    [
        *(np.full(size, value) for size in _SIZES for value in (0.0, 1.0, -0.4)),
        *([0, 1, 0, 0], [1.0] * 3, (0.0, 0.0, 2.0, -1.0), np.arange(6)),
        *(np.full(6, 400.0), np.full(6, 60.0), np.full(3, 19.0)),
    ]
)
#: Stamps of no time, of the limits of integers, and of no integer.
STAMPS: list[Any] = [0, 1, -1, 5, 2**31, 2**40, 2**61, 2**62 - 1, 2**62, 2**63, 2**64, 10**30, 0.5, True]
#: Leaps of a stamp [ns].
LEAPS = [-(10**12), -(10**9), -40_000_000, -4_000_000, -1, 0, 1, 19_000_000, 21_000_000, 900_000_000, 10**9 + 1, 36**9]
#: Types of numbers that may hold a whole one, and the bound of what they are given.
INTEGERS: dict[type, int] = {
    np.int8: 100,
    np.int32: 2**31,
    np.uint32: 2**31,
    np.int64: 2**63,
    np.uint64: 2**63,
    np.float64: 2**63,
    Count: 2**80,
}


#: Factors and offsets of believable wrong numbers.
_FACTORS, _OFFSETS = (-1.0, 0.0, 0.1, 0.5, 3.0, 5.0, 1e3), (0.0, 0.1, -3.0)
_TYPES = ("list", "tuple", "longdouble", "big-endian", "object", "strided", "masked", "subclass")


class Mutator:
    """Mutations.

    Args:
        choices: Source of all choices.
        lies: Whether believable wrong values are among them; without, everything wrong can be refused.
    """

    def __init__(self, choices: random.Random, lies: bool) -> None:
        self.random, self.lies = choices, lies
        self._things = [*THINGS, *REFUSED_NUMBERS, *((*ODD_NUMBERS, *ODD_VECTORS) if lies else ())]

    def thing(self) -> Any:
        """Any value."""
        return self.random.choice(self._things)

    def mutate(self, value: Any) -> Any:
        """A value that differs in one to three places."""
        if dataclasses.is_dataclass(value) and not isinstance(value, type):
            return self._instance(value)
        if isinstance(value, np.ndarray):
            return self._array(value)
        if hasattr(value, "_fields"):
            name = self.random.choice(value._fields)
            return value._replace(**{name: self.mutate(getattr(value, name))})
        if isinstance(value, tuple | list) and value and self.random.random() < 0.8:
            return self._sequence(value)
        if type(value) is int:
            return self._whole(value)
        if isinstance(value, float) and self.lies and self.random.random() < 0.3:
            return value * self.random.choice(_FACTORS)
        return self.thing()

    def _instance(self, value: Any) -> Any:
        names = [field.name for field in dataclasses.fields(value)]
        if self.random.random() < 0.03:
            return self.thing()
        chosen = self.random.sample(names, self.random.choice((1, 1, 1, 2, 3)))
        return dataclasses.replace(value, **{name: self.mutate(getattr(value, name)) for name in chosen})

    def _array(self, value: np.ndarray) -> Any:
        choice = self.random.random()
        if choice < 0.4 or value.size == 0:
            return self.thing()
        if choice < 0.7:
            changed = value.astype(self.random.choice((object, np.longdouble, float, float, float)))
            numbers = REFUSED_NUMBERS[:8] if changed.dtype == object else REFUSED_NUMBERS[:6]
            changed.flat[self.random.randrange(changed.size)] = self.random.choice(numbers)
            return changed
        if choice < 0.85 or not self.lies:
            return _other_type(value, self.random.choice(_TYPES))
        return value * self.random.choice(_FACTORS) + self.random.choice(_OFFSETS)

    def _sequence(self, value: Any) -> Any:
        entries = list(value)
        choice = self.random.random()
        if choice < 0.6:
            place = self.random.randrange(len(entries))
            entries[place] = self.mutate(entries[place])
        elif choice < 0.75:
            entries = entries * self.random.choice((0, 2, 7, 2000))
        elif choice < 0.9 or not self.lies:
            entries.insert(0, self.thing())
        else:
            entries.reverse()
        return entries if self.random.random() < 0.2 else tuple(entries)

    def _whole(self, value: int) -> Any:
        choice = self.random.random()
        if choice < 0.3:
            return self.random.choice(STAMPS)
        if choice < 0.6:
            return value + self.random.choice(LEAPS)
        if choice < 0.8:
            kind, bound = self.random.choice(list(INTEGERS.items()))
            return kind(value % bound)
        return self.thing()


def _other_type(value: np.ndarray, kind: str) -> Any:
    """The same numbers in another type; which of them are accepted is the check's business."""
    if kind in ("list", "tuple"):
        return value.tolist() if kind == "list" else tuple(value.tolist())
    if kind == "strided":
        return np.repeat(value, 2, axis=0)[::2]
    if kind in ("masked", "subclass"):
        return np.ma.array(value) if kind == "masked" else value.copy().view(Unit)
    return value.astype({"longdouble": np.longdouble, "big-endian": ">f8", "object": object}[kind])
