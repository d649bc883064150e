"""Logs with whole chunks whose content no recorder writes: they end there, or one line names the reason."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from mcap.writer import CompressionType, Writer
from recorded_flights import record

from ibvs_qp.config.errors import ConfigError
from ibvs_qp.config.files import UnreadableFile
from ibvs_qp.recording import compare_preset, read_log, replay
from ibvs_qp.recording.messages import message_class
from ibvs_qp.recording.reader import entries, records
from ibvs_qp.recording.ticks import ControllerInput, ControlTick
from tests.replay.cases import CASES

TICKS = 40
KINDS = {"/controller/input": ControllerInput, "/control": ControlTick}
Change = Callable[[Any, Any], None]


@pytest.fixture(scope="module", params=["pilot", "assured"])
def good(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("log") / f"{request.param}.mcap"
    record(file, "rotor_loss", request.param, TICKS)
    return file


def crafted(good: Path, file: Path, change: Change, first: int) -> Path:
    """The log without its end; ``change(input, tick)`` edits both messages of every tick from the first on."""
    contents: list[Any] = []
    with open(good, "rb") as stream:
        for each in records(stream):
            contents += entries(each) if type(each).__name__ == "Chunk" else [each]
    facts = next(each for each in contents if type(each).__name__ == "Metadata")
    topics = {each.id: each.topic for each in contents if type(each).__name__ == "Channel"}
    messages = [
        message_class(KINDS[topics[each.channel_id]]).FromString(each.data)
        for each in contents
        if type(each).__name__ == "Message" and topics[each.channel_id] in KINDS
    ]
    pairs = list(zip(messages[::2], messages[1::2], strict=True))
    for pair in pairs[first:]:
        change(*pair)
    with open(file, "wb") as stream:
        writer = Writer(stream, compression=CompressionType.NONE)
        writer.start()
        writer.add_metadata(facts.name, facts.metadata)
        channels = [writer.register_channel(topic, "protobuf", 0) for topic in KINDS]
        for pair in pairs:
            for channel, message in zip(channels, pair, strict=True):
                writer.add_message(channel, 1, message.SerializeToString(), 1)
        writer.finish()
    return file


def test_unchanged_it_replays(good: Path, tmp_path: Path) -> None:
    result = replay(read_log(crafted(good, tmp_path / "x.mcap", lambda *_: None, 0)))
    assert result.same and result.ticks == TICKS and not result.complete


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
def test_what_no_recorder_writes_ends_the_log(good: Path, tmp_path: Path, change: str) -> None:
    flight = read_log(crafted(good, tmp_path / "x.mcap", CHANGES[change], 10))
    assert replay(flight).ticks == 10 and not flight.complete
    with pytest.raises(UnreadableFile, match="no ticks"):
        read_log(crafted(good, tmp_path / "x.mcap", CHANGES[change], 0))


def test_thrusts_of_another_vehicle_are_refused(good: Path, tmp_path: Path) -> None:
    def change(given: Any, _: Any) -> None:
        given.call = "supervisor"
        given.fixed_thrusts[:] = [1.0, 2.0]

    flight = read_log(crafted(good, tmp_path / "x.mcap", change, 10))
    if flight.facts["kind"] == "assured":  # its log has no calls of the supervisor
        assert replay(flight).ticks == 10
        return
    for run in (replay, lambda flight: compare_preset(flight, CASES["rotor_loss"].config())):
        with pytest.raises(ConfigError, match="tick 10: 2 thrusts of the supervisor, 6 rotors of the law"):
            run(flight)


@pytest.mark.parametrize("field", ["thrusts", "wrench", "unallocated_wrench"])
def test_arrays_of_another_length_differ(good: Path, tmp_path: Path, field: str) -> None:
    def change(_: Any, tick: Any) -> None:
        getattr(tick.command, field).append(1.0)

    result = replay(read_log(crafted(good, tmp_path / "x.mcap", change, 10)))
    assert result.first is not None and result.first.field == field and result.ticks == TICKS
