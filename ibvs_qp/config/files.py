"""The one reader of files from outside: regular files up to a size, and TOML bounded in depth and integer range."""

from __future__ import annotations

import os
import re
import stat
import tomllib
from collections.abc import Iterable
from pathlib import Path
from typing import Any, BinaryIO

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

#: Largest TOML file [bytes]: fifty times the largest shipped one; the parser takes 2 s for it at most.
LARGEST_TOML = 1 << 20
#: Deepest nesting of tables and lists [-]: shipped files have 6 levels; code that reads tables calls itself per level.
DEEPEST = 32
#: Range of integers in TOML; larger ones need not fit a float.
INTEGERS = range(-(2**63), 2**63)
_KEY = r"""(?:[\w-]++|"(?:[^"\\\n]|\\.)*+"|'[^'\n]*+')"""
#: A dotted key of more parts than `DEEPEST`: the parser's time grows with their square. The search itself is linear: a
#: key begins after a blank, a bracket, a comma or a dot, the next quote ends a quoted one, and nothing is tried twice.
_DEEP_KEY = re.compile(rf"(?<![^\s\[{{,.])(?:{_KEY}[ \t]*+\.[ \t]*+){{{DEEPEST}}}", re.ASCII)


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


def read_toml(file: str | Path) -> dict[str, Any]:
    """Tables of a TOML file.

    Raises:
        ConfigError: When the file cannot be read or `parse_toml` refuses it.
    """
    return parse_toml(read_bytes(file, LARGEST_TOML), file)


def parse_toml(content: bytes | str, place: str | Path) -> dict[str, Any]:
    """Tables of TOML text.

    Args:
        content: The text.
        place: File or place that messages name.

    Raises:
        ConfigError: When it is no TOML in UTF-8, is nested too deep, or has an integer beyond 64 bits.
    """
    try:
        text = content.decode("utf-8-sig") if isinstance(content, bytes) else content  # a mark of Windows editors
        if _DEEP_KEY.search(text):
            raise RecursionError
        table = tomllib.loads(text)
        _check(table)
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ConfigError(f"{place} is not valid TOML: {error}") from None
    except ValueError:  # from `_check`, or from the parser beyond Python's limit of digits
        raise ConfigError(f"{place} is not valid TOML: an integer has more than 64 bits") from None
    except RecursionError:
        raise ConfigError(f"{place} is refused: more than {DEEPEST} levels of tables and lists") from None
    return table


def _check(table: dict[str, Any]) -> None:
    """Raise RecursionError for too deep nesting and ValueError for too large an integer; level by level, no calls."""
    level: list[Any] = [table]
    for _ in range(DEEPEST + 1):
        if not level:
            return
        entries = [entry for each in level for entry in _entries(each)]
        if any(isinstance(entry, int) and entry not in INTEGERS for entry in entries):
            raise ValueError
        level = [entry for entry in entries if isinstance(entry, (dict, list))]
    raise RecursionError


def _entries(each: dict[str, Any] | list[Any]) -> Iterable[Any]:
    return each.values() if isinstance(each, dict) else each
