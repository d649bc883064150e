"""Reads a log back tick by tick, from files of unknown origin too, and as far as a killed process wrote."""

from __future__ import annotations

import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

from google.protobuf.message import DecodeError
from mcap.exceptions import InvalidMagic, McapError
from mcap.records import Channel, Chunk, Footer, Message, Metadata
from mcap.stream_reader import StreamReader, breakup_chunk

from ibvs_qp.command import Command
from ibvs_qp.config.errors import ConfigError
from ibvs_qp.config.files import UnreadableFile, open_regular
from ibvs_qp.recording.header import FORMAT, PILOT, digest
from ibvs_qp.recording.malformed import from_json
from ibvs_qp.recording.messages import decode, message_class
from ibvs_qp.recording.ticks import RESET, STEP, SUPERVISOR, ControllerInput, ControlTick
from ibvs_qp.recording.topics import CONTROL_TOPIC, INPUT_TOPIC
from ibvs_qp.recording.writer import END, METADATA

#: Largest log [bytes]: an hour of pictures at 4 MB/s. Largest record in it: a chunk has 0.1 s.
LARGEST_FILE, LARGEST_RECORD = 1 << 34, 1 << 26
#: Facts of the header that replay needs.
_NEEDED = ("version", "kind", "law", "config", "config_sha256", "safety", "rows")
#: Errors of content that no recorder wrote.
_DAMAGE = (
    ArithmeticError, ConfigError, DecodeError, LookupError, McapError, MemoryError, RecursionError, TypeError,
    ValueError, struct.error,
)  # fmt: skip


class RecordedTick(NamedTuple):
    """One tick of a log."""

    given: ControllerInput
    command: Command | None  # of the law, or of what replaced it; None for a reset


@dataclass
class RecordedFlight:
    """A log.

    Attributes:
        file: The file.
        facts: Its header: version, kind, law, config and so on (`ibvs_qp.recording.header`).
        complete: Whether the last pass of `ticks` came to the end that `Recorder.close` writes.
        count: Ticks flown, as this end says; some may be missing in the log.
    """

    file: Path
    facts: Mapping[str, str]
    complete: bool = False
    count: int | None = None

    def ticks(self) -> Iterator[RecordedTick]:
        """The ticks in their order, up to the end, or to the first damage."""
        self.complete, self.count = False, None
        with open_regular(self.file, LARGEST_FILE) as stream:
            yield from undamaged(self._ticks(stream))

    def _ticks(self, stream: BinaryIO) -> Iterator[RecordedTick]:
        waiting: ControllerInput | None = None
        for topic, data in self._messages(stream):
            if topic == INPUT_TOPIC:
                waiting = self._input(data)
                if waiting.call == RESET:
                    yield RecordedTick(waiting, None)
            elif waiting is not None:
                message = message_class(ControlTick).FromString(data)
                _check_plain(message)
                _check_plain(message.command)
                if message.tick == waiting.tick:
                    yield RecordedTick(waiting, decode(message.command, Command))

    def _input(self, data: bytes) -> ControllerInput:
        message = message_class(ControllerInput).FromString(data)
        _check_plain(message, but=("measurement", "reference", "contact"))
        given: ControllerInput = decode(message, ControllerInput)
        calls = (STEP, SUPERVISOR, RESET) if self.facts["kind"] == PILOT else (STEP, RESET)
        if given.call not in calls or (given.fixed_thrusts is None) == (given.call == SUPERVISOR):
            raise ValueError(f"call {given.call[:20]!r}")
        return given

    def _messages(self, stream: BinaryIO) -> Iterator[tuple[str, bytes]]:
        """Topic and content of the messages that replay needs."""
        topics: dict[int, str] = {}
        for record in records(stream):
            if isinstance(record, Chunk):
                for entry in entries(record):
                    if isinstance(entry, Channel):
                        topics[entry.id] = entry.topic
                    elif isinstance(entry, Message) and topics.get(entry.channel_id) in (INPUT_TOPIC, CONTROL_TOPIC):
                        yield topics[entry.channel_id], entry.data
            elif isinstance(record, Metadata) and record.name == END:
                self.count = int(record.metadata["ticks"])
            elif isinstance(record, Footer):
                self.complete = self.count is not None


def undamaged(contents: Iterator[Any]) -> Iterator[Any]:
    """What comes before the first damage."""
    while True:
        try:
            yield next(contents)
        except (StopIteration, *_DAMAGE):
            return


def _check_plain(message: Any, but: tuple[str, ...] = ()) -> None:
    """Refuse malformed fields, except for inputs that the controller must meet again."""
    if message.malformed and not from_json(message.malformed).keys() <= set(but):
        raise ValueError("malformed fields")


def records(stream: BinaryIO) -> Iterator[Any]:
    """Records of an MCAP file, chunks as they are."""
    return iter(StreamReader(stream, emit_chunks=True, record_size_limit=LARGEST_RECORD).records)


def entries(chunk: Chunk) -> list[Any]:
    """Schemas, channels and messages of a chunk."""
    if chunk.compression:
        raise ConfigError(f"its chunks are compressed ({chunk.compression}); write them plain with 'mcap decompress'")
    return breakup_chunk(chunk, validate_crc=True)


def read_log(file: str | Path) -> RecordedFlight:
    """Open a log.

    Args:
        file: The file, complete or as a killed process left it.

    Returns:
        The flight; its ticks are read lazily.

    Raises:
        UnreadableFile: When it is missing, special, too large, no MCAP file, no log of this package, or of another
            format.
    """
    with open_regular(file, LARGEST_FILE) as stream:
        try:
            facts = _header(stream)
        except InvalidMagic:
            raise UnreadableFile(file, "it is no MCAP file") from None
        except _DAMAGE as error:
            raise UnreadableFile(file, f"it is no whole MCAP file ({type(error).__name__})") from None
    if facts is None:
        raise UnreadableFile(file, "it is no log of ibvs_qp: it has no such metadata")
    if facts.get("format") != FORMAT:
        reason = f"it has format {facts.get('format', '')[:20]!r}, this version reads {FORMAT!r}"
        raise UnreadableFile(file, reason)
    if any(name not in facts for name in _NEEDED) or digest(facts["config"]) != facts["config_sha256"]:
        raise UnreadableFile(file, "its header is damaged")
    flight = RecordedFlight(Path(file), facts)
    _check_first(flight)
    return flight


def _header(stream: BinaryIO) -> dict[str, str] | None:
    """The metadata record of the recorder, which comes before the first chunk."""
    for record in records(stream):
        if isinstance(record, Metadata) and record.name == METADATA:
            return record.metadata
        if isinstance(record, Chunk):
            return None
    return None


def _check_first(flight: RecordedFlight) -> None:
    """Refuse a log without a single tick, with the reason of the first chunk."""
    with open_regular(flight.file, LARGEST_FILE) as stream:
        try:
            chunk = next((record for record in records(stream) if isinstance(record, Chunk)), None)
            if chunk is not None:
                entries(chunk)
        except ConfigError as error:
            raise UnreadableFile(flight.file, str(error)) from None
        except _DAMAGE:
            pass
    if next(flight.ticks(), None) is None:
        raise UnreadableFile(flight.file, "it has no ticks of a controller")
