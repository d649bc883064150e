"""Ctrl-C and SIGTERM end a flight in the same way: with the flight so far on disk."""

from __future__ import annotations

import contextlib
import os
import signal
import threading
import time
from collections.abc import Callable, Iterator
from typing import Any

#: Time between looks for the parent [s], and the exit code of a process without one.
_WATCH_S, EXIT_ORPHAN = 1.0, 1


class _Sigterm:
    """Whether SIGTERM came, whether it must wait, and whether one waits."""

    came = deferred = waits = False


@contextlib.contextmanager
def sigterm_as_ctrl_c() -> Iterator[Callable[[], bool]]:
    """Handle SIGTERM like Ctrl-C while the context is open; in the main thread, signals reach no other.

    Yields:
        A function: whether SIGTERM came.
    """
    _Sigterm.came = _Sigterm.waits = False
    if threading.current_thread() is not threading.main_thread():
        yield lambda: False
        return
    previous = signal.signal(signal.SIGTERM, _on_sigterm)
    try:
        yield lambda: _Sigterm.came
    finally:
        signal.signal(signal.SIGTERM, previous)


def _on_sigterm(_number: int, frame: Any) -> None:
    _Sigterm.came, _Sigterm.waits = True, _Sigterm.deferred
    if _Sigterm.deferred:
        return
    handler = signal.getsignal(signal.SIGINT)
    if not callable(handler):  # a shell without job control starts its background jobs with Ctrl-C ignored
        raise KeyboardInterrupt
    handler(signal.SIGINT, frame)


@contextlib.contextmanager
def handled_ctrl_c(handler: Any) -> Iterator[None]:
    """Handle Ctrl-C by a handler meanwhile, in the main thread.

    While it is ignored (`signal.SIG_IGN`), which child processes inherit, SIGTERM waits for the end of the context.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    previous = signal.signal(signal.SIGINT, handler)
    _Sigterm.deferred = handler == signal.SIG_IGN
    try:
        yield
    finally:
        _Sigterm.deferred = False
        signal.signal(signal.SIGINT, previous)
        if _Sigterm.waits:
            _on_sigterm(signal.SIGTERM, None)


def ignore_stop() -> None:
    """Ignore Ctrl-C and SIGTERM in a worker: a stop of the whole group leaves it to the parent to end it."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_IGN)


def live_with_parent() -> None:
    """The same, and end when the parent was killed, since a killed parent stops no worker."""
    ignore_stop()
    threading.Thread(target=_watch, args=(os.getppid(),), daemon=True).start()


def _watch(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(_WATCH_S)
    os._exit(EXIT_ORPHAN)
