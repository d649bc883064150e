"""Messages of a log are read back bit-identical; types and topics are those of viewers."""

from __future__ import annotations

import dataclasses
import json
import math
import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcap.reader import make_reader
from recorded_flights import logged, record
from references import good_reference

from ibvs_qp import LineFeature, LineReference, Measurement, PaperController, Reference
from ibvs_qp.estimation.contact_state import ContactState
from ibvs_qp.interfaces.log import FOXGLOVE_LAYOUT
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


#: Topics of simulated flights alone, and the fields of them that the layout plots.
TRUTH = re.compile(r"/truth/(vehicle|board|pose|state\.push_n)$")
TICKS = 1300
FOXGLOVE = {
    "/camera/image": "CompressedImage",
    "/camera/calibration": "CameraCalibration",
    "/camera/detections": "ImageAnnotations",
    "/camera/depth": "RawImage",
    "/camera/depth_calibration": "CameraCalibration",
    "/camera/overlay": "CompressedImage",
    "/tf": "FrameTransforms",
    "/vehicle/pose": "PoseInFrame",
    "/vehicle/shape": "SceneUpdate",
    "/vehicle/points": "PointCloud",
    "/vehicle/forces": "SceneUpdate",
    "/wall/shape": "SceneUpdate",
    "/wall/points": "PointCloud",
    "/log": "Log",
}


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("log") / "a.mcap"
    record(file, "paint_qp", "pilot", TICKS)
    return file


def strings(value: Any) -> Iterator[str]:
    if isinstance(value, dict | list):
        for each in (*value, *(value.values() if isinstance(value, dict) else ())):
            yield from strings(each)
    elif isinstance(value, str):
        yield value


@pytest.mark.slow
def test_topics_and_fields_are_those_of_viewers_and_layout(log: Path) -> None:
    messages = logged(log)
    counts, latest = Counter(topic for topic, _ in messages), dict(messages)
    assert counts["/control"] == counts["/controller/input"] == counts["/sensors"] == TICKS
    kinds = {topic: content.DESCRIPTOR.full_name for topic, content in latest.items()}
    assert {topic: f"foxglove.{kind}" for topic, kind in FOXGLOVE.items()}.items() <= kinds.items()
    assert latest["/camera/image"].data[:2] == b"\xff\xd8"
    with open(log, "rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None and {chunk.compression for chunk in summary.chunk_indexes} == {""}
    layout = json.loads(FOXGLOVE_LAYOUT.read_text(encoding="utf-8"))
    named = [text for text in strings(layout["configById"]) if text.startswith("/")]
    assert len(named) > 25
    for text in named:
        if not TRUTH.match(text):
            topic, *path = text.split(".")
            kind = latest[topic].DESCRIPTOR
            for part in path:  # such as command.thrusts[0]
                field = kind.fields_by_name[part.split("[")[0]]
                assert ("[" in part) == field.is_repeated, text
                kind = field.message_type or kind
    assert sorted(text for text in strings(layout["layout"]) if "!" in text) == sorted(layout["configById"])
