"""Standard output of ``ibvs-qp``: no traceback for a closed, full or broken one, no foreign line next to JSON."""

from __future__ import annotations

import contextlib
import io
import os
import sys
from collections.abc import Iterator


def prepare_streams() -> None:
    """A closed stream becomes the null device, so that no file gets its number; output never fails for a character."""
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, mode, encoding="utf-8"))
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")


def drop_output() -> None:
    """Discard output that cannot be written, or the interpreter would try again at its end, and print a traceback."""
    try:
        sys.stdout.flush()
    except OSError:
        with open(os.devnull, "wb") as nothing:
            os.dup2(nothing.fileno(), sys.stdout.fileno())


@contextlib.contextmanager
def own_output() -> Iterator[None]:
    """Keep standard output for Python's own writes: C libraries write to standard error meanwhile.

    OSQP prints "Solver interrupted" after Ctrl-C, which would stand before the line of JSON.
    """
    if sys.stdout is not sys.__stdout__ or sys.stdout.fileno() != 1:
        yield  # redirected already
        return
    sys.stdout.flush()
    copy = os.dup(1)
    os.dup2(2, 1)
    sys.stdout = os.fdopen(copy, "w", encoding=sys.stdout.encoding, errors=sys.stdout.errors)
    try:
        yield
        sys.stdout.flush()
    finally:
        os.dup2(copy, 1)
        with contextlib.suppress(OSError):
            sys.stdout.close()
        sys.stdout = sys.__stdout__
