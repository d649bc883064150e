"""Types and topics of a log are those of viewers; the layout of Foxglove names topics and fields that it has."""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from mcap.reader import make_reader
from recorded_flights import logged, record

from ibvs_qp.interfaces.log import FOXGLOVE_LAYOUT

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
