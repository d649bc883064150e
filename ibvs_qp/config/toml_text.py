"""TOML from outside as plain tables: bounded in size, depth and the range of its integers."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from ibvs_qp.config.errors import ConfigError
from ibvs_qp.config.files import read_bytes

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
        text = content.decode() if isinstance(content, bytes) else content
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
