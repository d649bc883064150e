"""Logs that are none, damaged or crafted: they end at the damage, or one line names the reason."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.records import Channel, Message
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, Writer
from recorded_flights import record

from ibvs_qp.config.errors import ConfigError
from ibvs_qp.config.files import UnreadableFile
from ibvs_qp.interfaces.log import compare_preset, read_log, replay
from ibvs_qp.interfaces.log.header import digest
from ibvs_qp.interfaces.log.messages import message_class
from ibvs_qp.interfaces.log.topics import ControllerInput, ControlTick
from tests.replay.cases import CASES

#: Place of the length of its records in an uncompressed chunk [bytes].
LENGTH_OF_RECORDS = 41
KINDS = {"/controller/input": ControllerInput, "/control": ControlTick}
Change = Callable[[Any, Any], None]
FACTS = dict.fromkeys(("kind", "law", "safety", "rows"), "") | {"version": "1", "format": "1", "config": "a"}
FACTS |= {"config_sha256": digest("a")}


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    file = tmp_path_factory.mktemp("log") / "a.mcap"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("ibvs_qp.interfaces.log.writer.FLUSH_S", 0.0)  # chunks by ticks, whatever the machine's speed
        record(file, "rotor_loss", "controller", 300)
    return file.read_bytes()


def written(
    file: Path,
    facts: dict[str, str] | None,
    messages: list[tuple[str, bytes]],
    compression: CompressionType = CompressionType.NONE,
) -> Path:
    """An MCAP file of a header and messages."""
    with open(file, "wb") as stream:
        writer = Writer(stream, compression=compression)
        writer.start()
        if facts is not None:
            writer.add_metadata("ibvs_qp", facts)
        channels = {topic: writer.register_channel(topic, "protobuf", 0) for topic in KINDS}
        for topic, data in messages:
            writer.add_message(channels[topic], 1, data, 1)
        writer.finish()
    return file


def refused(file: Path) -> str:
    with pytest.raises(UnreadableFile) as caught:
        read_log(file)
    return caught.value.reason


def test_what_is_no_log_is_refused_with_its_reason(tmp_path: Path, good: bytes) -> None:
    file = tmp_path / "x.mcap"
    for content, reason in ((b"no log of a flight", "it is no MCAP file"), (good[:30], "no whole MCAP file")):
        file.write_bytes(content)
        assert reason in refused(file)
    for facts, reason in (
        (None, "no log of ibvs_qp"),
        (FACTS | {"format": "2"}, "format '2'"),
        (FACTS | {"config": "b"}, "header is damaged"),
        ({"format": "1"}, "header is damaged"),
        (FACTS, "no ticks"),
    ):
        assert reason in refused(written(file, facts, [("/controller/input", b"{}" * 100)]))
    for facts, reason in ((None, "no log of ibvs_qp"), (FACTS, "compressed (zstd)")):
        assert reason in refused(written(file, facts, [("/controller/input", b"{}" * 100)], CompressionType.ZSTD))


@pytest.mark.slow
def test_a_log_cut_anywhere_is_read_up_to_there_or_refused(tmp_path: Path, good: bytes) -> None:
    ticks = []
    for ratio in np.linspace(0.0, 1.0, 40):
        (tmp_path / "x.mcap").write_bytes(good[: int(ratio * len(good))])
        try:
            result = replay(read_log(tmp_path / "x.mcap"))
        except UnreadableFile:
            continue
        assert result.same and result.complete == (ratio == 1.0)
        ticks.append(result.ticks)
    assert ticks == sorted(ticks) and ticks[-1] == 300 and len(set(ticks)) > 20


def test_a_damaged_length_beyond_the_memory_ends_the_log_there(tmp_path: Path, good: bytes) -> None:
    file = tmp_path / "x.mcap"
    file.write_bytes(good)
    with open(file, "rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    chunk = summary.chunk_indexes[100]
    place = chunk.chunk_start_offset + LENGTH_OF_RECORDS
    assert int.from_bytes(good[place : place + 8], "little") == chunk.uncompressed_size
    file.write_bytes(good[:place] + (2**56).to_bytes(8, "little") + good[place + 8 :])
    result = replay(read_log(file))
    assert result.same and not result.complete and 50 < result.ticks < 150


@pytest.mark.parametrize("places", [15, pytest.param(60, marks=pytest.mark.slow)])
def test_flipped_bytes_are_found_or_harmless(tmp_path: Path, good: bytes, places: int) -> None:
    random = np.random.default_rng(2)
    file, seen = tmp_path / "x.mcap", set[str]()
    for place in random.integers(0, len(good), places):
        broken = bytearray(good)
        broken[place] ^= 1 << int(random.integers(8))
        file.write_bytes(broken)
        try:
            result: Any = replay(read_log(file))
        except UnreadableFile:
            seen.add("refused")
            continue
        assert result.same and result.ticks <= 300
        seen.add("whole" if result.ticks == 300 else "cut")
    assert seen >= {"cut", "whole"}


Crafted = Callable[[Change, int], Path]


@pytest.fixture(scope="module", params=["pilot", "assured"])
def crafted(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Crafted:
    """A log of 40 ticks without its end; ``change(input, tick)`` edits the messages of every tick from the first on."""
    folder = tmp_path_factory.mktemp("log")
    record(folder / "good.mcap", "rotor_loss", request.param, 40)
    with open(folder / "good.mcap", "rb") as stream:
        contents: list[Any] = list(StreamReader(stream).records)
    topics = {each.id: each.topic for each in contents if isinstance(each, Channel)}
    messages = [(topics[each.channel_id], each.data) for each in contents if isinstance(each, Message)]

    def craft(change: Change, first: int) -> Path:
        parsed = [(topic, message_class(KINDS[topic]).FromString(data)) for topic, data in messages if topic in KINDS]
        for (_, given), (_, tick) in list(zip(parsed[::2], parsed[1::2], strict=True))[first:]:
            change(given, tick)
        facts = dict(read_log(folder / "good.mcap").facts)
        return written(folder / "x.mcap", facts, [(topic, each.SerializeToString()) for topic, each in parsed])

    return craft


CHANGES: dict[str, Change] = {
    "unknown call": lambda given, _: setattr(given, "call", "fly"),
    "supervisor without thrusts": lambda given, _: setattr(given, "call", "supervisor"),
    "thrusts without supervisor": lambda given, _: given.fixed_thrusts.extend([1.0] * 6),
    "tick of a wrong type": lambda given, _: setattr(given, "malformed", '{"tick": "a"}'),
    "thrusts of a wrong type": lambda _, tick: setattr(tick.command, "malformed", '{"thrusts": 1}'),
    "limits of a wrong type": lambda _, tick: setattr(tick.command, "malformed", '{"active_limits": [1]}'),
    "no command": lambda _, tick: setattr(tick, "malformed", '{"command": null}'),
}


@pytest.mark.parametrize("change", CHANGES)
def test_what_no_recorder_writes_ends_the_log(crafted: Crafted, change: str) -> None:
    flight = read_log(crafted(CHANGES[change], 10))
    assert replay(flight).ticks == 10 and not flight.complete
    assert "no ticks" in refused(crafted(CHANGES[change], 0))


def test_thrusts_of_another_vehicle_are_refused(crafted: Crafted) -> None:
    def change(given: Any, _: Any) -> None:
        given.call = "supervisor"
        given.fixed_thrusts[:] = [1.0, 2.0]

    flight = read_log(crafted(change, 10))
    if flight.facts["kind"] == "assured":  # its log has no calls of the supervisor
        assert replay(flight).ticks == 10
        return
    for run in (replay, lambda flight: compare_preset(flight, CASES["rotor_loss"].config())):
        with pytest.raises(ConfigError, match="tick 10: 2 thrusts of the supervisor, 6 rotors of the law"):
            run(flight)


@pytest.mark.parametrize("field", ["", "thrusts", "wrench", "unallocated_wrench"])
def test_arrays_of_another_length_differ(crafted: Crafted, field: str) -> None:
    result = replay(read_log(crafted(lambda _, tick: getattr(tick.command, field).append(1.0) if field else None, 10)))
    assert result.ticks == 40 and not result.complete and (result.first.field if result.first else "") == field
