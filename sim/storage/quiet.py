"""Libraries in other languages that print errors, which the caller also gets as an exception."""

from __future__ import annotations

import contextlib
import os
import threading
from collections.abc import Iterator

_one_at_a_time = threading.Lock()


@contextlib.contextmanager
def no_library_output() -> Iterator[None]:
    """Close standard error for the duration: decoders print a damaged file's warnings, Polars a stack trace."""
    with _one_at_a_time, open(os.devnull, "wb") as nothing:
        kept = os.dup(2)
        os.dup2(nothing.fileno(), 2)
        try:
            yield
        finally:
            os.dup2(kept, 2)
            os.close(kept)
