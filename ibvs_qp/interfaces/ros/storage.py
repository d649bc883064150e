"""Storage files of ROS 2 bags, MCAP and SQLite: channels, and messages in the order of recording.

Only the parts that a file must have are used: an MCAP file is read without its indexes and summary, up to its end or
its first damage; a SQLite file together with the write-ahead log beside it.
"""

from __future__ import annotations

import contextlib
import heapq
import io
import shutil
import sqlite3
import struct
import tempfile
import zlib
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

from ibvs_qp.config.files import UnreadableFile, open_regular

#: Largest data file of a bag [bytes]: half a terabyte holds three hours of raw pictures.
LARGEST_DATA = 1 << 39
#: Largest chunk and message after decompression [bytes]: four pictures of `interfaces.ros.messages.MOST_ENTRIES`.
LARGEST_UNPACKED = 1 << 28
#: Largest definition of a type or channel, and most data of chunks that overlap in time [bytes].
LARGEST_DEFINITION, LARGEST_HELD = 1 << 22, 1 << 30
#: First bytes of the formats.
MCAP_MAGIC, SQLITE_MAGIC, ROS1_MAGIC = b"\x89MCAP0\r\n", b"SQLite format 3\0", b"#ROSBAG V"
_ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"
#: Opcodes of MCAP records, sizes of a record's head and of a chunk's times.
_HEADER, _FOOTER, _SCHEMA, _CHANNEL, _MESSAGE, _CHUNK, _STATISTICS = 0x01, 0x02, 0x03, 0x04, 0x05, 0x06, 0x0B
_HEAD, _TIMES = struct.Struct("<BQ"), struct.Struct("<QQ")
#: Memory of a waiting message beside its data [bytes].
_MESSAGE_BYTES = 300
#: Bytes of a chunk before its content, with the longest name of a compression.
_CHUNK_HEAD = 44


class Channel(NamedTuple):
    """Topic and type of messages, with the definition of the type in the file."""

    topic: str
    type_name: str
    format: str = ""  # "ros2msg", "ros2idl", or empty for none
    definition: str = ""


class Recorded(NamedTuple):
    """A message."""

    time_ns: int  # of its recording
    channel: Channel
    data: bytes


class McapStorage:
    """An MCAP file.

    Attributes:
        profile: Of the header: "ros2" for a bag.
        channels: Its channels.
        stated: Messages of each topic that the file itself states; empty without statistics.
        damage: Where and how it ends before its end; empty if it is whole.
        damages: Damaged chunks by their place; complete after `messages`.

    Args:
        file: The file.

    Raises:
        UnreadableFile: When it is special or too large.
    """

    def __init__(self, file: Path) -> None:
        self._stream: BinaryIO = open_regular(file, LARGEST_DATA)
        self._schemas: dict[int, tuple[str, str, str]] = {}
        self._channels: dict[int, Channel] = {}
        #: Start and end of recording, place and size of every part that holds messages.
        self._parts: list[tuple[int, int, int, int, int]] = []
        self.profile, self.stated, self.damage, self.damages = "", Counter[str](), "", dict[int, str]()
        self._cut = -1  # place of a chunk that the file ends in
        try:
            self._scan()
        except BaseException:
            self.close()
            raise
        self.channels = list(self._channels.values())

    def close(self) -> None:
        """Close the file."""
        self._stream.close()

    def messages(self, topics: set[str]) -> Iterator[Recorded]:
        """Messages of some topics by the time of their recording; equal times in the order of the file."""
        waiting: list[tuple[int, int, int, Recorded]] = []
        held = 0
        for start, _, place, size, opcode in sorted(self._parts):
            while waiting and waiting[0][0] < start:
                message = heapq.heappop(waiting)[3]
                held -= len(message.data) + _MESSAGE_BYTES
                yield message
            for number, (channel_id, time_ns, data) in enumerate(self._messages(place, size, opcode)):
                channel = self._channels.get(channel_id)
                if channel is not None and channel.topic in topics:
                    heapq.heappush(waiting, (time_ns, place, number, Recorded(time_ns, channel, data)))
                    held += len(data) + _MESSAGE_BYTES
            if held > LARGEST_HELD:
                raise ValueError(f"its chunks overlap in time by more than {LARGEST_HELD} bytes")
        while waiting:
            yield heapq.heappop(waiting)[3]

    def _scan(self) -> None:
        """Find parts, schemas, channels and statistics by the heads of the records alone."""
        end = self._stream.seek(0, io.SEEK_END)
        place, counts = len(MCAP_MAGIC), dict[int, int]()
        while place + _HEAD.size <= end:
            self._stream.seek(place)
            opcode, size = _HEAD.unpack(self._stream.read(_HEAD.size))
            start, place = place + _HEAD.size, place + _HEAD.size + size
            if opcode == _FOOTER and place <= end:
                break
            if place > end:
                self.damage = f"it ends within a record, at byte {end}"
                if opcode == _CHUNK and _CHUNK_HEAD < end - start <= LARGEST_UNPACKED:
                    times = _TIMES.unpack(self._stream.read(_TIMES.size))
                    self._parts.append((*times, start, end - start, opcode))
                    self._cut = start
                break
            if opcode == 0:  # reserved room that a killed recorder did not fill
                self.damage = f"it has no records from byte {start - _HEAD.size} on"
                break
            if opcode in (_CHUNK, _MESSAGE):
                times = self._stream.read(16) if opcode == _CHUNK else self._stream.read(14)[6:] * 2
                self._parts.append((*_TIMES.unpack(times), start, size, opcode))
            elif opcode in (_HEADER, _SCHEMA, _CHANNEL, _STATISTICS) and size <= LARGEST_DEFINITION:
                self._define(opcode, self._stream.read(size), counts)
        else:
            self.damage = self.damage or "it has no end, as of a recorder that was killed"
        if not counts or counts.keys() - self._channels.keys():  # a summary need not repeat the channels
            for _, _, start, size, opcode in self._parts:
                if opcode == _CHUNK:
                    self._messages(start, size, opcode)
        for channel_id, count in counts.items():
            if channel_id in self._channels:
                self.stated[self._channels[channel_id].topic] += count

    def _messages(self, place: int, size: int, opcode: int) -> list[tuple[int, int, bytes]]:
        """Messages of a part: channel, time [ns], data. Its schemas and channels are taken as well."""
        if size > LARGEST_UNPACKED:
            raise ValueError(f"a part has {size} bytes, at most {LARGEST_UNPACKED} are read")
        self._stream.seek(place)
        data = self._stream.read(size)
        if opcode == _MESSAGE:
            return [_message(data)]
        found: list[tuple[int, int, bytes]] = []
        if place == self._cut:
            with contextlib.suppress(Exception):  # the file ends here: the messages before count
                self._records(_cut_chunk(data), found)
            return found
        content, whole = _chunk(data)
        if not whole:
            self.damages[place] = f"the chunk at byte {place} is damaged and left out"
            return []
        self._records(content, found)
        return found

    def _records(self, content: bytes, found: list[tuple[int, int, bytes]]) -> None:
        """Append the messages of a chunk's content, and take its schemas and channels."""
        place = 0
        while place + _HEAD.size <= len(content):
            opcode, size = _HEAD.unpack_from(content, place)
            place += _HEAD.size
            record = content[place : place + size]
            place += size
            if place > len(content) or opcode == 0:
                break
            if opcode == _MESSAGE:
                found.append(_message(record))
            elif opcode in (_SCHEMA, _CHANNEL):
                self._define(opcode, record, {})

    def _define(self, opcode: int, record: bytes, counts: dict[int, int]) -> None:
        from mcap import records
        from mcap.data_stream import ReadDataStream

        stream = ReadDataStream(io.BytesIO(record))
        if opcode == _HEADER:
            self.profile = records.Header.read(stream).profile
        elif opcode == _SCHEMA:
            schema = records.Schema.read(stream)
            self._schemas[schema.id] = (schema.name, schema.encoding, schema.data.decode(errors="replace"))
        elif opcode == _CHANNEL:
            channel = records.Channel.read(stream)
            if channel.schema_id not in self._schemas and channel.schema_id:
                return  # a summary need not repeat the schemas: the chunk has both
            name, kind, text = self._schemas.get(channel.schema_id, ("", "", ""))
            self._channels.setdefault(channel.id, Channel(channel.topic, name, kind if text else "", text))
        else:
            counts.update(records.Statistics.read(stream).channel_message_counts)


class SqliteStorage:
    """A SQLite file; one with a write-ahead log is read from a copy of both, so that neither is changed.

    Attributes and arguments as of `McapStorage`; such a file states no counts.
    """

    def __init__(self, file: Path) -> None:
        open_regular(file, LARGEST_DATA).close()
        self.stated, self.damage, self.damages = Counter[str](), "", dict[int, str]()
        with contextlib.ExitStack() as stack:
            self._open(file, stack)
            self._close = stack.pop_all()

    def _open(self, file: Path, stack: contextlib.ExitStack) -> None:
        log = file.with_name(f"{file.name}-wal")
        if log.is_file() and log.stat().st_size:
            folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
            for each in (file, log):
                shutil.copyfile(each, folder / each.name)
            address = f"{(folder / file.name).as_uri()}?mode=ro"
        else:
            address = f"{file.resolve().as_uri()}?immutable=1"
        self._base = stack.enter_context(contextlib.closing(sqlite3.connect(address, uri=True)))
        self._channels = {key: self._channel(name, kind) for key, name, kind in self._topics()}
        self.channels = list(self._channels.values())

    def close(self) -> None:
        """Close the file."""
        self._close.close()

    def messages(self, topics: set[str]) -> Iterator[Recorded]:
        """As of `McapStorage`."""
        chosen = [str(key) for key, channel in self._channels.items() if channel.topic in topics]
        places = ", ".join("?" * len(chosen))
        text = f"SELECT topic_id, timestamp, data FROM messages WHERE topic_id IN ({places}) ORDER BY timestamp, id"  # nosec
        for key, time_ns, data in self._base.execute(text, chosen):
            if not isinstance(data, bytes):
                raise ValueError("a message is no blob")
            yield Recorded(int(time_ns), self._channels[key], data)

    def _topics(self) -> list[Any]:
        return self._base.execute("SELECT id, name, type FROM topics").fetchall()

    def _channel(self, topic: str, type_name: str) -> Channel:
        """A channel with its definition, which older files do not have."""
        text = "SELECT encoding, encoded_message_definition FROM message_definitions WHERE topic_type = ?"
        try:
            found = self._base.execute(text, (type_name,)).fetchone()
        except sqlite3.Error:
            found = None
        return Channel(str(topic), str(type_name), *(map(str, found) if found and found[1] else ()))


def open_storage(file: Path) -> McapStorage | SqliteStorage:
    """A storage file by its first bytes, with any name.

    Raises:
        UnreadableFile: When it is none, special, or too large.
    """
    with open_regular(file, LARGEST_DATA) as stream:
        head = stream.read(max(map(len, (MCAP_MAGIC, SQLITE_MAGIC, ROS1_MAGIC))))
    if head.startswith(MCAP_MAGIC):
        return McapStorage(file)
    if head.startswith(SQLITE_MAGIC):
        return SqliteStorage(file)
    if head.startswith(ROS1_MAGIC):
        raise UnreadableFile(file, "it is a bag of ROS 1; convert it with 'rosbags-convert'")
    if head.startswith(_ZSTD_MAGIC):
        raise UnreadableFile(file, "it is compressed as a whole file; decompress it with 'ros2 bag convert'")
    raise UnreadableFile(file, "it is neither MCAP nor SQLite")


def unpacked(data: bytes) -> bytes:
    """A message that was compressed by itself, or as it is."""
    return _zstd(data, LARGEST_UNPACKED) if data.startswith(_ZSTD_MAGIC) else data


def _message(record: bytes) -> tuple[int, int, bytes]:
    channel_id, _, time_ns = struct.unpack_from("<HIQ", record)
    return channel_id, time_ns, record[22:]


def _chunk(record: bytes) -> tuple[bytes, bool]:
    """Content of a chunk, and whether it has its checksum."""
    from mcap import records
    from mcap.data_stream import ReadDataStream

    chunk = records.Chunk.read(ReadDataStream(io.BytesIO(record)))
    unpack = {"": lambda data, _: data, "zstd": _zstd, "lz4": _lz4}.get(chunk.compression)
    if unpack is None:
        raise ValueError(f"compression {chunk.compression[:20]!r} is unknown")
    content = unpack(chunk.data, chunk.uncompressed_size)
    return content, chunk.uncompressed_crc in (0, zlib.crc32(content))


def _cut_chunk(record: bytes) -> bytes:
    """Content of a chunk up to the end of its file."""
    name_size = int.from_bytes(record[28:32], "little")
    name, data = record[32 : 32 + name_size].decode(), record[40 + name_size :]
    if not name:
        return data
    from lz4.frame import LZ4FrameDecompressor
    from rosbags.rosbag2.storage_mcap import zstd

    decompressor: Any = {"zstd": zstd.ZstdDecompressor, "lz4": LZ4FrameDecompressor}[name]()
    try:
        return decompressor.decompress(data, LARGEST_UNPACKED)
    except Exception:  # cut within the first block
        return b""


def _zstd(data: bytes, size: int) -> bytes:
    from rosbags.rosbag2.storage_mcap import zstd

    return _bounded(zstd.ZstdDecompressor(), data, size)


def _lz4(data: bytes, size: int) -> bytes:
    from lz4.frame import LZ4FrameDecompressor

    return _bounded(LZ4FrameDecompressor(), data, size)


def _bounded(decompressor: Any, data: bytes, size: int) -> bytes:
    """A frame of at most a size and at most `LARGEST_UNPACKED` [bytes]."""
    largest = min(size, LARGEST_UNPACKED)
    raw = decompressor.decompress(data, largest + 1)
    if len(raw) > largest or not decompressor.eof:
        raise ValueError(f"a compressed part is cut, or has more than {largest} bytes")
    return raw
