"""What is read back is bit-identical to what was written, whatever it is."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from references import good_reference

from ibvs_qp import LineFeature, LineReference, Measurement, PaperController, Reference
from ibvs_qp.estimation.contact_state import ContactState
from ibvs_qp.interfaces.log.messages import Malformed, decode, encode, message_class
from ibvs_qp.interfaces.log.topics import STEP, ControllerInput

NUMBERS = st.floats(width=64)  # NaN, infinities and negative zero, too
INTEGERS = st.integers(-(2**63), 2**63 - 1)


def arrays(*shape: int) -> st.SearchStrategy[np.ndarray]:
    size = math.prod(shape)
    return st.lists(NUMBERS, min_size=size, max_size=size).map(lambda entries: np.array(entries).reshape(shape))


LINES = st.builds(
    LineFeature,
    rho=NUMBERS,
    theta=NUMBERS,
    covariance=arrays(2, 2),
    role=st.text(st.characters(exclude_categories=["Cs"])),
    weight=NUMBERS,
    stamp_ns=INTEGERS,
    segment=st.none() | arrays(2, 2),
)
MEASUREMENTS = st.builds(
    Measurement,
    stamp_ns=INTEGERS,
    attitude=arrays(4),
    angular_velocity=arrays(3),
    contact_wrench=arrays(6),
    wrench_stamp_ns=INTEGERS,
    specific_force=st.none() | arrays(3),
    lines=st.lists(LINES, max_size=3).map(tuple),
    plane=st.none() | st.tuples(*[NUMBERS] * 4),
    velocity_covariance=st.none() | arrays(3, 3),
    imu_stamp_ns=st.none() | INTEGERS,
)


def bits(value: Any) -> Any:
    """A value whose equality is that of its bits."""
    if isinstance(value, float):
        return np.float64(value).tobytes()
    if isinstance(value, np.ndarray):
        return value.shape, value.dtype, value.tobytes()
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return type(value), [bits(getattr(value, field.name)) for field in dataclasses.fields(value)]
    return [bits(entry) for entry in value] if isinstance(value, tuple | list) else value


def returned(value: Any) -> Any:
    kind = type(value)
    return decode(message_class(kind).FromString(encode(value).SerializeToString()), kind)


@given(MEASUREMENTS)
def test_measurements_return_to_the_bit(measurement: Measurement) -> None:
    assert bits(returned(measurement)) == bits(measurement)


def test_references_contacts_and_commands_return() -> None:
    reference = dataclasses.replace(good_reference(), lines=(LineReference(rho=-0.0, theta=1.5, role="horizontal"),))
    contact = PaperController().setpoints.contact
    assert isinstance(contact, ContactState) and math.isinf(contact.distance)
    command = dataclasses.replace(PaperController().step(None, reference), tasks=())  # type: ignore[arg-type]
    for value in (reference, contact, command):
        assert bits(returned(value)) == bits(value)


ODD: list[Any] = [None, "level", 3.0, True, np.zeros(0), np.zeros((2, 3)), np.array([1, 2, 3], np.uint8)]
ODD += [np.array([True, False]), [1.0, None, "x"], 10**400, "\ud800"]


@pytest.mark.parametrize("odd", ODD)
@pytest.mark.parametrize("field", ["attitude", "stamp_ns", "specific_force", "lines", "plane", "thrust_max"])
def test_what_a_field_cannot_hold_returns_as_it_was(field: str, odd: Any) -> None:
    example = Measurement(
        stamp_ns=1,
        attitude=np.array([1.0, 0.0, 0.0, 0.0]),
        angular_velocity=np.zeros(3),
        contact_wrench=np.zeros(6),
        wrench_stamp_ns=1,
    )
    found = getattr(returned(dataclasses.replace(example, **{field: odd})), field)
    if isinstance(found, Malformed):
        assert isinstance(odd, int)  # beyond what Python prints
    elif isinstance(odd, np.ndarray | list) and len(np.shape(odd)) == 1 and isinstance(found, np.ndarray | tuple):
        np.testing.assert_array_equal(np.array(found, object), np.array(odd, object))
    else:
        assert bits(found) == bits(odd) and type(found) is type(odd)


def test_an_input_that_is_no_measurement_returns() -> None:
    given = ControllerInput(tick=0, call=STEP, measurement="none", reference=Reference())  # type: ignore[arg-type]
    assert returned(given).measurement == "none"
    stranger = ControllerInput(tick=0, call=STEP, measurement=object())  # type: ignore[arg-type]
    assert returned(stranger).measurement.text == "object"
