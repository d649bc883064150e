"""Writes what a killed process left again, with end and index: most viewers refuse a file without."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from mcap.records import Channel, Chunk, Message, Metadata, Schema
from mcap.writer import CompressionType, Writer

from ibvs_qp.config.errors import IbvsQpError
from ibvs_qp.config.files import open_regular
from ibvs_qp.recording.reader import LARGEST_FILE, RecordedFlight, entries, records, undamaged


def repair(flight: RecordedFlight, file: str | Path) -> None:
    """Write a log up to its first damage.

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
                _copy(undamaged(_contents(stream)), writer)
                writer.finish()
                target.flush()
            except BaseException:
                Path(file).unlink()  # half a file would refuse the next attempt
                raise
    except OSError as error:
        raise IbvsQpError(f"cannot write {file}: {error.strerror or error}") from None


def _contents(stream: Any) -> Iterator[Any]:
    """Metadata, and what the chunks hold; None at the end of a chunk."""
    for record in records(stream):
        if isinstance(record, Metadata):
            yield record
        elif isinstance(record, Chunk):
            yield from entries(record)
            yield None


def _copy(contents: Iterator[Any], writer: Writer) -> None:
    schemas: dict[int, int] = {}
    channels: dict[int, int] = {}
    for entry in contents:
        if entry is None:
            writer.flush()
        elif isinstance(entry, Metadata):
            writer.add_metadata(entry.name, entry.metadata)
        elif isinstance(entry, Schema):
            schemas[entry.id] = writer.register_schema(entry.name, entry.encoding, entry.data)
        elif isinstance(entry, Channel):
            schema = schemas.get(entry.schema_id, 0)
            channels[entry.id] = writer.register_channel(entry.topic, entry.message_encoding, schema, entry.metadata)
        elif isinstance(entry, Message) and entry.channel_id in channels:
            writer.add_message(
                channels[entry.channel_id], entry.log_time, entry.data, entry.publish_time, entry.sequence
            )
