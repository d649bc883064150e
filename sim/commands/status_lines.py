"""Status lines of a control loop, written by a thread of their own: no terminal delays the loop."""

from __future__ import annotations

import contextlib
import os
import threading
from collections import deque

#: Shortest time between two lines [s]: a reason may change on every tick, a person reads a few a second.
GAP_S = 0.2
#: Longest wait for the last lines [s].
LAST_S = 1.0
#: File descriptor of standard output (POSIX).
STANDARD_OUTPUT = 1


class StatusLines:
    """Writes the newest line. While the output is blocked, lines are dropped; a closed output changes nothing.

    It writes to the descriptor: a thread that is blocked in `sys.stdout` would also block the end of the process.

    Args:
        descriptor: File descriptor of the output.
    """

    def __init__(self, descriptor: int = STANDARD_OUTPUT) -> None:
        self._descriptor, self._newest = descriptor, deque[str](maxlen=1)
        self._some, self._closing = threading.Event(), threading.Event()
        self._thread = threading.Thread(target=self._write, name="status lines", daemon=True)
        self._thread.start()

    def put(self, text: str) -> None:
        """Replace the line to write next; never blocks, and never raises."""
        self._newest.append(text)
        self._some.set()

    def close(self, text: str) -> None:
        """Write the last lines, and wait for them at most `LAST_S`."""
        self._newest.append(text)
        self._closing.set()
        self._some.set()
        self._thread.join(LAST_S)

    def _write(self) -> None:
        last = False
        while not last:
            self._some.wait()
            self._some.clear()
            last = self._closing.is_set()  # before the text is taken: that of `close` is then among those taken
            while self._newest:
                with contextlib.suppress(OSError):
                    os.write(self._descriptor, f"{self._newest.pop()}\n".encode(errors="replace"))
            self._closing.wait(GAP_S)
