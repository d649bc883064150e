"""The table of bounds: the comparison of lengths gives the same answer as one of entries."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ibvs_qp.measurement import Reference
from ibvs_qp.validation.fields import REFERENCE, Field, FieldTable

ROWS = (
    Field("direction", 4, -1.01, 1.01, "-", unit_length=True),
    Field("number", 0, -1.0, 2.0, "m"),
    Field("speed", 2, -3.0, 3.0, "m/s", optional=True),
)
TABLE = FieldTable(*ROWS)
values = st.sampled_from([0.0, 1.0, -1.0, 2.0, 3.0, -3.0, 3.1, math.nan, math.inf])


class Input:
    def __init__(self, **fields: Any) -> None:
        self.__dict__.update({"direction": np.array([0.0, 1.0, 0.0, 0.0]), "number": 0.5, "speed": None} | fields)


@given(st.lists(values, min_size=7, max_size=7))
def test_a_vector_is_accepted_by_its_length_only_if_its_entries_are(packed: list[float]) -> None:
    source = Input(direction=np.array(packed[:4]), number=packed[4], speed=np.array(packed[5:]))
    unit = abs(sum(entry * entry for entry in packed[:4]) - 1.0) <= 0.02
    good = [unit, -1.0 <= packed[4] <= 2.0, all(-3.0 <= entry <= 3.0 for entry in packed[5:])]
    assert TABLE.faults(source) == [row for row, accepted in zip(ROWS, good, strict=True) if not accepted]


@pytest.mark.parametrize(
    ("name", "good", "bad"),
    [
        ("direction", [np.array([0.6, 0.8, 0.0, 0.0])], [np.zeros(4), np.array([0, 1, 0, 0]), np.eye(4), None]),
        ("number", [-1, 2.0, np.float64(0.1)], [2.1, math.nan, None, "1", 10**400, np.array(1.0)]),
        ("speed", [None, np.array([3.0, -3.0]), np.zeros(2, np.float32)], [np.full(2, 3.1), [0.0, 0.0], 1.0]),
    ],
)
def test_type_shape_and_bounds(name: str, good: list[Any], bad: list[Any]) -> None:
    for value in good:
        assert TABLE.faults(Input(**{name: value})) == []
    for value in bad:
        assert [row.name for row in TABLE.faults(Input(**{name: value}))] == [name], value


def test_reasons() -> None:
    reference = Reference(push_force=-1.0, standoff=99.0, tilt=np.ones(2), velocity=np.full(2, math.nan))
    assert [row.rejection for row in REFERENCE.faults(reference)] == [
        "push_force: not within [0, 1000] N",
        "standoff: not within [-1, 10] m",
        "velocity: not 2 finite values",
        "tilt: not 2 finite values within 0.6 rad",
    ]
