"""The one reader of files from outside: regular files up to a size; nothing else is opened for its content."""

from __future__ import annotations

import os
import stat
from pathlib import Path
from typing import BinaryIO

from ibvs_qp.config.errors import ConfigError

#: A FIFO without a writer must not block, a terminal must not become ours; systems without an option lack its name.
_FLAGS = os.O_RDONLY | sum(getattr(os, name, 0) for name in ("O_NONBLOCK", "O_NOCTTY", "O_CLOEXEC", "O_BINARY"))
_KINDS = {
    stat.S_IFDIR: "a directory",
    stat.S_IFIFO: "a pipe",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
    stat.S_IFSOCK: "a socket",
}


class UnreadableFile(ConfigError):
    """A file that is missing, not regular, too large, or refused by the system.

    Attributes:
        reason: Why, without the file's name.
    """

    def __init__(self, file: str | Path, reason: str) -> None:
        super().__init__(f"cannot read {file}: {reason}")
        self.reason = reason


def open_regular(file: str | Path, largest: int) -> BinaryIO:
    """Open a regular file for reading.

    Args:
        file: The file.
        largest: Largest size [bytes].

    Raises:
        UnreadableFile: When it is missing, larger, or a directory, device, pipe or socket.
    """
    try:
        stream = open(os.open(file, _FLAGS), "rb")
    except (OSError, ValueError) as error:  # ValueError: a zero byte in the name
        raise UnreadableFile(file, getattr(error, "strerror", None) or str(error)) from None
    found = os.fstat(stream.fileno())
    if stat.S_ISREG(found.st_mode) and found.st_size <= largest:
        return stream
    stream.close()
    if stat.S_ISREG(found.st_mode):
        raise UnreadableFile(file, f"it has {found.st_size} bytes, at most {largest} are read")
    raise UnreadableFile(file, f"it is {_KINDS.get(stat.S_IFMT(found.st_mode), 'special')}, not a regular file")


def read_bytes(file: str | Path, largest: int) -> bytes:
    """Whole content of a regular file.

    Args:
        file: The file.
        largest: Largest size [bytes].

    Raises:
        UnreadableFile: As in `open_regular`, or when reading fails.
    """
    with open_regular(file, largest) as stream:
        try:
            content = stream.read(largest + 1)
        except OSError as error:
            raise UnreadableFile(file, error.strerror or str(error)) from None
    if len(content) > largest:  # it grew, or the system gives no size as under /proc
        raise UnreadableFile(file, f"it has more than {largest} bytes")
    return content
