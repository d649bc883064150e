"""A pipe between two processes whose far end is woken on a core of its own."""

from __future__ import annotations

import pickle
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnContext
from multiprocessing.synchronize import Semaphore
from typing import Any

#: How often one who waits looks whether the other end still exists [s].
_LOOK_S = 0.5


class RungPipe:
    """One end of a pipe; who waits for a message waits for a bell, and reads the pipe when it has rung.

    A kernel takes a write to a pipe as a hint that the writer is about to wait, and wakes the reader on the writer's
    own core: the writer then stands still as long as the reader works, however many cores are idle. A semaphore gives
    no such hint.

    Args:
        pipe: This end.
        rung: Rings for this end.
        other: Rings for the other end.
    """

    def __init__(self, pipe: Connection, rung: Semaphore, other: Semaphore) -> None:
        self._pipe, self._rung, self._other = pipe, rung, other

    @classmethod
    def pair(cls, context: SpawnContext) -> tuple[RungPipe, RungPipe]:
        """Both ends of a new pipe."""
        (here, there), bells = context.Pipe(), (context.Semaphore(0), context.Semaphore(0))
        return cls(here, *bells), cls(there, *reversed(bells))

    def send(self, message: Any) -> None:
        """Send a message; one larger than the pipe's buffer waits until the other end looks.

        Raises:
            OSError: When the other end is closed.
        """
        self._pipe.send_bytes(pickle.dumps(message, pickle.HIGHEST_PROTOCOL))  # half the time of the pipe's own
        self._other.release()

    def poll(self, timeout_s: float) -> bool:
        """Whether a message or the other end's end came within a time [s]."""
        return self._pipe.poll(timeout_s)

    def recv(self) -> Any:
        """Wait for a message.

        Raises:
            EOFError: When the other end is closed.
            OSError: Likewise.
        """
        while not self._rung.acquire(timeout=_LOOK_S):
            if self._pipe.poll():  # closed, or about to ring: a ring too many only makes the next wait one in the pipe
                break
        return pickle.loads(self._pipe.recv_bytes())

    def close(self) -> None:
        """Close this end."""
        self._pipe.close()
