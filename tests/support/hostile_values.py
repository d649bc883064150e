"""Values that no input should have: refused ones, lies that are accepted, and things that are no numbers at all."""

from __future__ import annotations

import math
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
