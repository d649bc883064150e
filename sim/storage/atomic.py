"""Files that are complete or absent: written under another name, flushed to the disk, then renamed."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from ibvs_qp.config.errors import IbvsQpError


class UnwritableFile(IbvsQpError, OSError):
    """A file that the system does not let us write: full disk, no permission, read-only."""


@contextlib.contextmanager
def replaced(file: Path) -> Iterator[Path]:
    """Another name to write a file under; when the context ends the file is replaced, after an error it is as before.

    Raises:
        UnwritableFile: When it cannot be written.
    """
    partial = file.with_name(f".{os.getpid()}-{file.name}")
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        try:
            yield partial
            with open(partial, "rb") as written:
                os.fsync(written.fileno())
            partial.replace(file)
        finally:
            partial.unlink(missing_ok=True)
    except UnwritableFile:
        raise  # another file, written meanwhile
    except OSError as error:
        raise UnwritableFile(f"cannot write {file}: {error.strerror or error}") from None


@contextlib.contextmanager
def replacing(file: Path) -> Iterator[BinaryIO]:
    """A stream whose content becomes the file as in `replaced`."""
    with replaced(file) as partial, open(partial, "wb") as stream:
        yield stream


def write_text(file: Path, text: str) -> None:
    """Write a text file at once.

    Raises:
        UnwritableFile: When it cannot be written.
    """
    with replacing(file) as stream:
        stream.write(text.encode())
