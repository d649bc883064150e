"""Reads a log tick by tick, from files of unknown origin too, and logs of killed processes up to their end."""

from __future__ import annotations

import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

from google.protobuf.message import DecodeError
from mcap.exceptions import InvalidMagic, McapError
from mcap.records import Channel, Chunk, Footer, Message, Metadata, Schema
from mcap.stream_reader import StreamReader, breakup_chunk
from mcap.writer import CompressionType, Writer

from ibvs_qp.command import Command
from ibvs_qp.config.errors import ConfigError, IbvsQpError
from ibvs_qp.config.files import UnreadableFile, open_regular
from ibvs_qp.interfaces.log import topics
from ibvs_qp.interfaces.log.header import FORMAT, PILOT, digest
from ibvs_qp.interfaces.log.messages import decode, malformed_fields, message_class
from ibvs_qp.interfaces.log.topics import ControllerInput, ControlTick
from ibvs_qp.interfaces.log.writer import END, METADATA

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
    command: Command | None  # of the law, or of the supervisor in its place; None for a reset


@dataclass
class RecordedFlight:
    """A log."""

    file: Path
    facts: Mapping[str, str]  # version, kind, law, config and so on (`ibvs_qp.interfaces.log.header`)
    complete: bool = False  # the last pass of `ticks` came to the end that `Recorder.close` writes
    count: int | None = None  # ticks of the flight, stated there; some may be missing in the log
    phase: str = ""  # of a pilot's strategy at the last tick that `ticks` gave

    def ticks(self) -> Iterator[RecordedTick]:
        """The ticks in their order, up to the end, or to the first damage."""
        self.complete, self.count = False, None
        with open_regular(self.file, LARGEST_FILE) as stream:
            yield from _undamaged(self._ticks(stream))

    def _ticks(self, stream: BinaryIO) -> Iterator[RecordedTick]:
        names: dict[int, str] = {}
        given: ControllerInput | None = None
        for record in _contents(stream):
            topic = names.get(record.channel_id) if isinstance(record, Message) else None
            if topic == topics.INPUT_TOPIC:
                given = self._input(record.data)
                if given.call == topics.RESET:
                    yield RecordedTick(given, None)
            elif topic == topics.CONTROL_TOPIC and given is not None:
                row = message_class(ControlTick).FromString(record.data)
                _check_plain(row)
                _check_plain(row.command)
                if row.tick == given.tick:
                    self.phase = str(row.phase)
                    yield RecordedTick(given, decode(row.command, Command))
            elif isinstance(record, Channel):
                names[record.id] = record.topic
            elif isinstance(record, Metadata) and record.name == END:
                self.count = int(record.metadata["ticks"])
            elif isinstance(record, Footer):
                self.complete = self.count is not None

    def _input(self, data: bytes) -> ControllerInput:
        message = message_class(ControllerInput).FromString(data)
        _check_plain(message, but=("measurement", "reference", "contact"))
        given: ControllerInput = decode(message, ControllerInput)
        calls = {topics.STEP, topics.RESET} | ({topics.SUPERVISOR} if self.facts["kind"] == PILOT else set())
        if given.call not in calls or (given.fixed_thrusts is None) == (given.call == topics.SUPERVISOR):
            raise ValueError(f"call {given.call[:20]!r}")
        return given


def _check_plain(message: Any, but: tuple[str, ...] = ()) -> None:
    """Refuse malformed fields, except for inputs that the replayed controller must refuse again."""
    if not malformed_fields(message).keys() <= set(but):
        raise ValueError("malformed fields")


def records(stream: BinaryIO) -> Iterator[Any]:
    """Records of an MCAP file, chunks as they are."""
    return iter(StreamReader(stream, emit_chunks=True, record_size_limit=LARGEST_RECORD).records)


def entries(chunk: Chunk) -> list[Any]:
    """Schemas, channels and messages of a chunk."""
    if chunk.compression:
        raise ConfigError(f"its chunks are compressed ({chunk.compression}); write them plain with 'mcap decompress'")
    return breakup_chunk(chunk, validate_crc=True)


def _contents(stream: BinaryIO) -> Iterator[Any]:
    """Records, those of a chunk before the chunk."""
    for record in records(stream):
        if isinstance(record, Chunk):
            yield from entries(record)
        yield record


def _undamaged(contents: Iterator[Any]) -> Iterator[Any]:
    """Contents before the first damage."""
    while True:
        try:
            yield next(contents)
        except (StopIteration, *_DAMAGE):
            return


def read_log(file: str | Path) -> RecordedFlight:
    """Open a log.

    Args:
        file: The file, complete or of a killed process.

    Returns:
        The flight; its ticks are read lazily.

    Raises:
        UnreadableFile: When it is missing, special, too large, no MCAP file, no log of this package, or of another
            format.
    """
    facts, damage = None, None
    with open_regular(file, LARGEST_FILE) as stream:
        try:
            for record in records(stream):
                if isinstance(record, Metadata) and record.name == METADATA:
                    facts = record.metadata
                elif isinstance(record, Chunk):  # the header comes before the first one
                    if facts is not None:
                        entries(record)
                    break
        except _DAMAGE as error:
            damage = error
    flight = RecordedFlight(Path(file), facts or {})
    if isinstance(damage, InvalidMagic):
        reason = "it is no MCAP file"
    elif facts is None and damage is not None:
        reason = f"it is no whole MCAP file ({type(damage).__name__})"
    elif facts is None:
        reason = "it is no log of ibvs_qp: it has no such metadata"
    elif facts.get("format") != FORMAT:
        reason = f"it has format {facts.get('format', '')[:20]!r}, this version reads {FORMAT!r}"
    elif any(name not in facts for name in _NEEDED) or digest(facts["config"]) != facts["config_sha256"]:
        reason = "its header is damaged"
    elif isinstance(damage, ConfigError):
        reason = str(damage)
    elif next(flight.ticks(), None) is None:
        reason = "it has no ticks of a controller"
    else:
        return flight
    raise UnreadableFile(file, reason)


def repair(flight: RecordedFlight, file: str | Path) -> None:
    """Write a log up to its first damage, with end and index: most viewers refuse a file without.

    Args:
        flight: The log.
        file: The new file.

    Raises:
        IbvsQpError: When it exists or cannot be written.
    """
    try:
        with open_regular(flight.file, LARGEST_FILE) as stream, open(file, "xb") as target:
            try:
                writer = Writer(target, compression=CompressionType.NONE)
                writer.start(profile="")
                _copy(stream, writer)
                writer.finish()
                target.flush()
            except BaseException:
                Path(file).unlink()  # half a file would refuse the next attempt
                raise
    except OSError as error:
        raise IbvsQpError(f"cannot write {file}: {error.strerror or error}") from None


def _copy(stream: BinaryIO, writer: Writer) -> None:
    schemas: dict[int, int] = {}
    channels: dict[int, int] = {}
    for each in _undamaged(_contents(stream)):
        if isinstance(each, Chunk):
            writer.flush()
        elif isinstance(each, Metadata):
            writer.add_metadata(each.name, each.metadata)
        elif isinstance(each, Schema):
            schemas[each.id] = writer.register_schema(each.name, each.encoding, each.data)
        elif isinstance(each, Channel):
            schema = schemas.get(each.schema_id, 0)
            channels[each.id] = writer.register_channel(each.topic, each.message_encoding, schema, each.metadata)
        elif isinstance(each, Message) and each.channel_id in channels:
            writer.add_message(channels[each.channel_id], each.log_time, each.data, each.publish_time, each.sequence)
