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
from google.protobuf.timestamp_pb2 import Timestamp
from mcap.well_known import MessageEncoding
from mcap.writer import CompressionType, Writer
from mcap_protobuf.schema import register_schema

from ibvs_qp.config.errors import IbvsQpError

#: Names of the metadata records at begin and end.
METADATA, END = "ibvs_qp", "ibvs_qp_end"
#: Topic of events in words.
LOG_TOPIC = "/log"
#: Longest time between writes to the file [s]: a killed process loses it and the queue.
FLUSH_S = 0.1
#: Pause of the thread without work [s].
IDLE_S = 0.01
#: Items in the queue beyond which all are refused: at 250 Hz 4 s of a controller, 2 s of a pilot with two a tick.
ROOM = 1000
#: Items beyond which pictures are refused: 0.5 s of a pilot, 30 MB of pictures.
PICTURE_ROOM = ROOM // 4
#: Longest wait for the rest of the queue at the end [s].
CLOSE_S = 30.0


def timestamp(ns: int) -> Timestamp:
    """A time in messages."""
    stamp = Timestamp()
    stamp.FromNanoseconds(ns)
    return stamp


class LogWriter:
    """An MCAP file, a bounded queue of calls, and the thread that makes the calls.

    The control loop uses `offer`, `wait_for_room` and `close`; the calls use `write` and `note`.

    Attributes:
        dropped: Calls refused so far, because the queue was full.
        problem: Why nothing more is written, such as a full disk; empty while all is well.
        stamp_ns: Time of the last message.

    Args:
        file: The file; it is replaced.
        metadata: Facts for the first metadata record.
        end: Called at the end for those of the last one.

    Raises:
        IbvsQpError: When the file cannot be written.
    """

    def __init__(self, file: str | Path, metadata: Mapping[str, str], end: Callable[[], Mapping[str, str]]) -> None:
        self._file, self._end, self._channels = Path(file), end, dict[str, int]()
        self._queue = deque[tuple[Callable[..., None], tuple[Any, ...]]]()
        self.dropped, self._noted, self.problem, self.stamp_ns = 0, 0, "", 0
        try:
            self._file.parent.mkdir(parents=True, exist_ok=True)
            self._stream = open(self._file, "wb")
            # Not compressed: most bytes are pictures that are compressed already, and every chunk stays short.
            self._writer = Writer(self._stream, compression=CompressionType.NONE)
            self._writer.start(profile="")
            self._writer.add_metadata(METADATA, dict(metadata))
            self._writer.flush()
        except OSError as error:
            raise IbvsQpError(f"cannot write the log {file}: {error.strerror or error}") from None
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._run, name="log", daemon=True)
        self._thread.start()
        atexit.register(self.close)

    def offer(self, call: Callable[..., None], *data: Any, room: int | None = None) -> bool:
        """Queue ``call(writer, *data)``; never waits, never raises.

        Args:
            call: Writes messages; runs in the thread.
            data: Its arguments; the caller must not modify them afterwards.
            room: Refuse with so many calls in the queue, `ROOM` by default.

        Returns:
            Whether it was taken.
        """
        if len(self._queue) >= (room or ROOM) or self._closing.is_set():
            self.dropped += 1
            return False
        self._queue.append((call, data))
        return True

    def wait_for_room(self) -> None:
        """Wait until nothing would be refused for a while, for loops that run faster than real time."""
        while len(self._queue) > PICTURE_ROOM // 2 and self._thread.is_alive():
            time.sleep(IDLE_S)

    def close(self) -> None:
        """Write the rest and the index; further calls are refused."""
        self._closing.set()
        atexit.unregister(self.close)
        self._thread.join(CLOSE_S)
        if self._thread.is_alive():
            self.problem = f"the log {self._file} was not finished within {CLOSE_S:g} s"

    def write(self, topic: str, message: Any, stamp_ns: int | None = None) -> None:
        """Write a protobuf message at a time, or at that of the last one."""
        if stamp_ns is not None and 0 <= stamp_ns < 2**63:
            self.stamp_ns = stamp_ns
        if topic not in self._channels:
            schema = register_schema(self._writer, type(message))
            self._channels[topic] = self._writer.register_channel(topic, MessageEncoding.Protobuf, schema)
        self._writer.add_message(self._channels[topic], self.stamp_ns, message.SerializeToString(), self.stamp_ns)
        time.sleep(0)  # lets the control loop have the interpreter

    def note(self, level: Any, name: str, text: str) -> None:
        """Write a line to `LOG_TOPIC`."""
        self.write(LOG_TOPIC, Log(timestamp=timestamp(self.stamp_ns), level=level, name=name, message=text))

    def _run(self) -> None:
        try:
            self._work()
            self._note_dropped()
            self._writer.flush()
            self._writer.add_metadata(END, dict(self._end()))
            self._writer.finish()
            self._stream.close()
        except OSError as error:
            self.problem = f"cannot write the log {self._file}: {error.strerror or error}; it ends there"
        except Exception as error:
            self.problem = f"the log {self._file} ends early ({type(error).__name__}: {error})"
        with contextlib.suppress(OSError):  # of the buffered rest, after an error that was reported
            self._stream.close()
        self._closing.set()
        self._queue.clear()

    def _work(self) -> None:
        flushed = time.monotonic()
        while self._queue or not self._closing.is_set():
            if self._queue:
                self._call(*self._queue.popleft())
            else:
                self._closing.wait(IDLE_S)
            if time.monotonic() - flushed >= FLUSH_S:
                self._writer.flush()
                flushed = time.monotonic()

    def _call(self, call: Callable[..., None], data: tuple[Any, ...]) -> None:
        self._note_dropped()
        try:
            call(self, *data)
        except OSError:
            raise
        except Exception as error:  # one bad record must not end the log
            self.note(Log.ERROR, "log", f"not written: {type(error).__name__}: {error}")

    def _note_dropped(self) -> None:
        if (dropped := self.dropped) > self._noted:
            text = f"{dropped - self._noted} entries are missing from here: the queue of the log was full"
            self._noted = dropped
            self.note(Log.WARNING, "log", text)
