"""A thread that writes an MCAP file: the control loop hands over references and copies, and never waits for it."""

from __future__ import annotations

import atexit
import contextlib
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from foxglove_schemas_protobuf.Log_pb2 import Log
from mcap.well_known import MessageEncoding
from mcap.writer import CompressionType, Writer
from mcap_protobuf.schema import register_schema

from ibvs_qp.config.errors import IbvsQpError

#: Names of the metadata records at begin and end.
METADATA, END = "ibvs_qp", "ibvs_qp_end"
#: Topic of what happened, in words.
LOG_TOPIC = "/log"
#: Longest time between writes to the file [s]: what a killed process loses, beside the queue.
FLUSH_S = 0.1
#: Pause of the thread without work [s].
IDLE_S = 0.01
#: Items in the queue beyond which nothing is taken: at 250 Hz 4 s of a controller, 2 s of a pilot with two a tick.
ROOM = 1000
#: Items beyond which no pictures are taken: 0.5 s of a pilot, 30 MB of pictures.
PICTURE_ROOM = ROOM // 4
#: Longest wait for the rest of the queue at the end [s].
CLOSE_S = 30.0
_STAMP_END = 2**63


class Sink:
    """The file, as the thread's encoders see it."""

    def __init__(self, file: Path, metadata: Mapping[str, str]) -> None:
        self._stream = open(file, "wb")
        # Not compressed: most bytes are pictures that are compressed already, and every chunk stays short.
        self._writer = Writer(self._stream, compression=CompressionType.NONE)
        self._channels: dict[str, int] = {}
        self.stamp_ns = 0
        self._writer.start(profile="")
        self._writer.add_metadata(METADATA, dict(metadata))
        self.flush()

    def write(self, topic: str, message: Any, stamp_ns: int | None = None) -> None:
        """Write a protobuf message at a time, or at that of the last one."""
        if stamp_ns is not None and 0 <= stamp_ns < _STAMP_END:
            self.stamp_ns = stamp_ns
        if topic not in self._channels:
            schema = register_schema(self._writer, type(message))
            self._channels[topic] = self._writer.register_channel(topic, MessageEncoding.Protobuf, schema)
        data = message.SerializeToString()
        self._writer.add_message(self._channels[topic], self.stamp_ns, data, self.stamp_ns)
        time.sleep(0)  # lets the control loop have the interpreter

    def note(self, level: int, name: str, text: str) -> None:
        """Write a line to `LOG_TOPIC`."""
        message = Log(level=level, name=name, message=text)  # type: ignore[arg-type]
        message.timestamp.FromNanoseconds(self.stamp_ns)
        self.write(LOG_TOPIC, message)

    def flush(self) -> None:
        """End the chunk and hand everything to the system."""
        self._writer.flush()

    def finish(self, metadata: Mapping[str, str]) -> None:
        """Write facts known at the end and the index, and close the file."""
        self._writer.flush()
        self._writer.add_metadata(END, dict(metadata))
        self._writer.finish()
        self._stream.close()

    def abandon(self) -> None:
        """Close the file as it is."""
        with contextlib.suppress(OSError):  # of what is still buffered, after an error that was reported
            self._stream.close()


Encoder = Callable[..., None]


class LogWriter:
    """A bounded queue and the thread that empties it.

    Attributes:
        dropped: Items refused because the queue was full, so far.
        problem: Why nothing more is written, such as a full disk; empty while all is well.

    Args:
        file: The file; it is replaced.
        metadata: Facts for the first metadata record.
        end: Called at the end for those of the last one.

    Raises:
        IbvsQpError: When the file cannot be written.
    """

    def __init__(self, file: str | Path, metadata: Mapping[str, str], end: Callable[[], Mapping[str, str]]) -> None:
        self._end = end
        self._file, self._queue = Path(file), deque[tuple[Encoder, tuple[Any, ...]]]()
        try:
            self._file.parent.mkdir(parents=True, exist_ok=True)
            self._sink = Sink(self._file, metadata)
        except OSError as error:
            raise IbvsQpError(f"cannot write the log {file}: {error.strerror or error}") from None
        self.dropped, self._noted, self.problem = 0, 0, ""
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._run, name="log", daemon=True)
        self._thread.start()
        atexit.register(self.close)

    def offer(self, encode: Encoder, *data: Any, room: int | None = None) -> bool:
        """Hand over what the thread shall pass to ``encode(sink, *data)``; never waits, never raises.

        Args:
            encode: Writes messages to the `Sink`; runs in the thread.
            data: Its arguments; the caller must not modify them afterwards.
            room: Refuse with so many items in the queue, `ROOM` by default.

        Returns:
            Whether it was taken.
        """
        if len(self._queue) >= (room or ROOM) or self._closing.is_set():
            self.dropped += 1
            return False
        self._queue.append((encode, data))
        return True

    def wait_for_room(self) -> None:
        """Wait until nothing would be refused for a while, for loops that fly faster than real time."""
        while len(self._queue) > PICTURE_ROOM // 2 and self._thread.is_alive():
            time.sleep(IDLE_S)

    def close(self) -> None:
        """Write the rest and the index; further items are refused."""
        self._closing.set()
        atexit.unregister(self.close)
        self._thread.join(CLOSE_S)
        if self._thread.is_alive():
            self.problem = f"the log {self._file} was not finished within {CLOSE_S:g} s"

    def _run(self) -> None:
        try:
            self._work()
            self._note_dropped()
            self._sink.finish(self._end())
        except OSError as error:
            self.problem = f"cannot write the log {self._file}: {error.strerror or error}; it ends there"
        except Exception as error:
            self.problem = f"the log {self._file} ends early ({type(error).__name__}: {error})"
        finally:
            self._sink.abandon()
        self._closing.set()
        self._queue.clear()

    def _work(self) -> None:
        flushed = time.monotonic()
        while self._queue or not self._closing.is_set():
            if self._queue:
                encode, data = self._queue.popleft()
                self._note_dropped()
                self._encode(encode, data)
            else:
                self._closing.wait(IDLE_S)
            if time.monotonic() - flushed >= FLUSH_S:
                self._sink.flush()
                flushed = time.monotonic()

    def _encode(self, encode: Encoder, data: tuple[Any, ...]) -> None:
        try:
            encode(self._sink, *data)
        except OSError:
            raise
        except Exception as error:  # one bad record must not end the log
            self._sink.note(Log.ERROR, "log", f"not written: {type(error).__name__}: {error}")

    def _note_dropped(self) -> None:
        if (dropped := self.dropped) > self._noted:
            text = f"{dropped - self._noted} entries are missing from here: the queue of the log was full"
            self._noted = dropped
            self._sink.note(Log.WARNING, "log", text)
