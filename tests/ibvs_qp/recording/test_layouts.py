"""The shipped layouts name topics and fields that a log has; Rerun reads a log."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from google.protobuf.descriptor import Descriptor
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from recorded_flights import record

from ibvs_qp.recording.layouts import FOXGLOVE
from ibvs_qp.recording.layouts.rerun_view import COMPONENT, PLOTS

#: Topics of simulated flights alone, and the fields of them that the layout plots.
TRUTH = re.compile(r"/truth/(vehicle|board|pose|state\.push_n)$")


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("log") / "a.mcap"
    record(file, "paint_qp", "pilot", 1300)
    return file


@pytest.fixture(scope="module")
def topics(log: Path) -> dict[str, Descriptor]:
    with open(log, "rb") as stream:
        messages = make_reader(stream, decoder_factories=[DecoderFactory()]).iter_decoded_messages()
        return {channel.topic: content.DESCRIPTOR for _, channel, _, content in messages}


def strings(value: Any) -> Iterator[str]:
    if isinstance(value, dict):
        for key, entry in value.items():
            yield key
            yield from strings(entry)
    elif isinstance(value, list):
        for entry in value:
            yield from strings(entry)
    elif isinstance(value, str):
        yield value


def check(kind: Descriptor, path: str) -> None:
    """Every part of a path such as ``.command.thrusts[0]`` is a field."""
    for part in path.split(".")[1:]:
        field = kind.fields_by_name[part.split("[")[0]]
        assert ("[" in part) == field.is_repeated, path
        kind = field.message_type or kind


def test_foxgloves_layout_names_what_a_log_has(topics: dict[str, Descriptor]) -> None:
    layout = json.loads(FOXGLOVE.read_text(encoding="utf-8"))
    named = [text for text in strings(layout["configById"]) if text.startswith("/")]
    assert len(named) > 25
    for text in named:
        if not TRUTH.match(text):
            topic, dot, rest = text.partition(".")
            assert topic in topics, text
            check(topics[topic], dot + rest)
    panels = [text for text in strings(layout["layout"]) if "!" in text]
    assert sorted(panels) == sorted(layout["configById"])


def test_reruns_layout_names_what_a_log_has(topics: dict[str, Descriptor]) -> None:
    assert COMPONENT == f"{topics['/control'].full_name}:message"
    for selectors in PLOTS.values():
        for selector in selectors:
            check(topics["/control"], selector)


def test_rerun_reads_a_log(log: Path, tmp_path: Path) -> None:
    pytest.importorskip("rerun", reason="rerun-sdk has 500 MB, and no extra installs it")
    view = [sys.executable, "-m", "ibvs_qp.recording.layouts.rerun_view", str(log), "--save", str(tmp_path / "a.rrd")]
    subprocess.run(view, check=True)
    shown = [sys.executable, "-m", "rerun", "rrd", "print", str(tmp_path / "a.rrd")]
    text = subprocess.run(shown, check=True, capture_output=True, text=True).stdout
    for wanted in ("EncodedImage:blob", "Pinhole:", "Transform3D:", "Points3D:positions", COMPONENT, "TextLog:text"):
        assert wanted in text, wanted
