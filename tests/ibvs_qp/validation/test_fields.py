"""The table of bounds: one comparison of the packed numbers gives the same answer as field by field."""

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
def test_one_comparison_and_field_by_field_agree(packed: list[float]) -> None:
    expected = [row for row in ROWS if not row.accepts(packed[TABLE.part[row.name]])]
    assert TABLE.faults(packed) == expected


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
        assert TABLE.faults(TABLE.pack(Input(**{name: value}))) == []
    for value in bad:
        assert [row.name for row in TABLE.faults(TABLE.pack(Input(**{name: value})))] == [name], value


def test_reasons() -> None:
    reference = Reference(push_force=-1.0, standoff=99.0, tilt=np.ones(2), velocity=np.full(2, math.nan))
    assert [row.rejection for row in REFERENCE.faults(REFERENCE.pack(reference))] == [
        "push_force: not within [0, 1000] N",
        "standoff: not within [-1, 10] m",
        "velocity: not 2 finite values",
        "tilt: not 2 finite values within 0.6 rad",
    ]
