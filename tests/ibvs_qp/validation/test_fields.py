"""The table of bounds: the comparison of lengths answers as one of entries; what is converted, and what is refused."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ibvs_qp.measurement import Measurement, Reference
from ibvs_qp.validation.fields import REFERENCE, Field, FieldTable, plain_instance

ROWS = (
    Field("direction", (4,), -1.01, 1.01, "-", unit_length=True, fallback=(1.0, 0.0, 0.0, 0.0)),
    Field("number", (), -1.0, 2.0, "m"),
    Field("speed", (2,), -3.0, 3.0, "m/s", optional=True, held=False),
)
TABLE = FieldTable(*ROWS)
values = st.sampled_from([0.0, 1.0, -1.0, 2.0, 3.0, -3.0, 3.1, math.nan, math.inf])


class Input:
    def __init__(self, **fields: Any) -> None:
        self.__dict__.update({"direction": np.array([0.0, 1.0, 0.0, 0.0]), "number": 0.5, "speed": None} | fields)


def refused(**fields: Any) -> list[str]:
    reasons: list[str] = []
    _, _, names = TABLE.read(Input(**fields), TABLE.fallbacks, reasons)
    assert [reason.split(":")[0] for reason in reasons] == sorted(names)
    return sorted(names)


@given(st.lists(values, min_size=7, max_size=7))
def test_a_vector_is_accepted_by_its_length_only_if_its_entries_are(packed: list[float]) -> None:
    unit = abs(sum(entry * entry for entry in packed[:4]) - 1.0) <= 0.02
    good = [unit, -1.0 <= packed[4] <= 2.0, all(-3.0 <= entry <= 3.0 for entry in packed[5:])]
    expected = [row.name for row, accepted in zip(ROWS, good, strict=True) if not accepted]
    assert refused(direction=np.array(packed[:4]), number=packed[4], speed=np.array(packed[5:])) == expected


class Quantity(np.ndarray):
    """Numbers in a unit of their own."""


class Nameless:
    def __init__(self) -> None:
        self.__class__.__name__ = "N" * 10**5


MASKED = np.ma.array([1.0, 2.0], mask=[False, True])
OBJECTS = np.array([1.0, None], dtype=object)


@pytest.mark.parametrize(
    ("name", "good", "bad"),
    [
        (
            "direction",
            [np.array([0, 1, 0, 0]), [1, 0, 0, 0], (0.6, 0.8, 0, 0), np.eye(4, dtype=np.float32)[1]],
            [np.zeros(4), np.eye(4), None, "abcd", [[1, 0, 0, 0]], [1, 0, 0], np.array([True, False, False, False])],
        ),
        (
            "number",
            [-1, 2.0, np.float64(0.1), np.float16(0.5), np.int8(1), np.uint64(2)],
            [2.1, math.nan, None, "1", 10**400, -(10**400), np.array(1.0), True, 1j, [1.0], np.float32(math.inf)],
        ),
        (
            "speed",
            [None, np.array([3.0, -3.0]), np.zeros(2, np.float32), [0, 0], (0.0, 1), np.zeros((2, 9))[:, 1]],
            [
                *(np.full(2, 3.1), 1.0, {0: 1.0, 1: 2.0}, iter([1.0, 2.0]), "12", b"12", np.array(["1", "2"])),
                *(MASKED, MASKED.filled(1e9), np.zeros(2).view(Quantity), OBJECTS, [10**400, 0], [[0.0], [0.0]]),
                *([np.zeros(1), 0.0], [True, False], np.zeros(2, complex), np.zeros((2, 1)), [0.0] * 10**6, [0.0]),
                *(np.zeros(2, "datetime64[ns]"), np.zeros(2, [("x", float)]), np.broadcast_to(0.0, (2, 10**9))),
                *(np.zeros(10**7), Nameless()),
            ],
        ),
    ],
)
def test_type_shape_and_bounds(name: str, good: list[Any], bad: list[Any]) -> None:
    for value in good:
        entries, changes, names = TABLE.read(Input(**{name: value}), TABLE.fallbacks, [])
        assert not names
        plain = changes.get(name, value)
        if value is not None:
            assert type(plain) in (float, np.ndarray) and np.asarray(plain).dtype == float
            assert np.array_equal(np.ravel(plain), np.ravel(value)) and np.ravel(plain).tolist() == entries[name]
    for value in bad:
        reasons: list[str] = []
        entries, changes, names = TABLE.read(Input(**{name: value}), TABLE.fallbacks, reasons)
        assert names == {name}, value
        assert len(reasons) == 1 and len(reasons[0]) < 150
        assert entries[name] == ([1.0, 0.0, 0.0, 0.0] if name == "direction" else None)
        assert np.array_equal(changes[name], entries[name])


def test_entries_are_copies() -> None:
    given = np.array([1.0, 2.0])
    entries, _, _ = TABLE.read(Input(speed=given), TABLE.fallbacks, [])
    given[:] = 9.0
    assert entries["speed"] == [1.0, 2.0]


def test_reasons_are_true() -> None:
    reference = Reference(
        push_force=-1.0,
        standoff="near",
        tilt=np.ones(2),
        velocity=np.full(2, 50.0),
        travel=np.zeros(3),  # type: ignore[arg-type]
    )
    reasons: list[str] = []
    REFERENCE.read(reference, REFERENCE.fallbacks, reasons)
    assert reasons == [
        "push_force: not within [0, 1000] N",
        "standoff: str, not a number",
        "velocity: not 2 finite values within 20 m/s",
        "tilt: not 2 finite values within 0.6 rad",
        "travel: array of float64 with shape (3,), not 2 numbers",
    ]


def test_a_subclass_that_computes_its_attributes_is_read_once() -> None:
    class Flickering(Measurement):
        reads = 0

        def __getattribute__(self, name: str) -> Any:
            if name == "angular_velocity":
                Flickering.reads += 1
                return np.full(3, 0.0 if Flickering.reads == 1 else math.nan)
            return super().__getattribute__(name)

    given = Flickering(
        stamp_ns=1, attitude=np.zeros(4), angular_velocity=np.zeros(3), contact_wrench=np.zeros(6), wrench_stamp_ns=1
    )
    plain = plain_instance(given, Measurement)
    assert type(plain) is Measurement and plain.angular_velocity.tolist() == [0.0] * 3
