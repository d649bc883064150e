"""Values that a field of the log cannot hold, as JSON: the checks of the controller meet them again in a replay."""

from __future__ import annotations

import json
from typing import Any

import numpy as np

#: Most entries of an array or list that are written.
MOST_ENTRIES = 1000
#: Longest integer that is written [bits]: Python prints no integer of more than 4300 digits.
LONGEST_BITS = 1024
_ARRAY, _OTHER = "array of", "value of type"


class Malformed:
    """Stands for a value that JSON cannot hold either.

    Attributes:
        text: Its type.
    """

    def __init__(self, text: str) -> None:
        self.text = text


def to_json(values: dict[str, Any]) -> str:
    """JSON of named values of any type; numbers keep all digits, NaN and infinity."""
    return json.dumps({name: _plain(value, 0) for name, value in values.items()})


def _plain(value: Any, depth: int) -> Any:
    if (
        value is None
        or type(value) in (bool, float, str)
        or (type(value) is int and value.bit_length() <= LONGEST_BITS)
    ):
        return value
    if type(value) is np.ndarray and value.dtype.kind in "fiub" and value.size <= MOST_ENTRIES:
        return {_ARRAY: str(value.dtype), "entries": value.tolist()}
    if isinstance(value, list | tuple) and len(value) <= MOST_ENTRIES and depth < 4:
        return [_plain(entry, depth + 1) for entry in value]
    return {_OTHER: type(value).__name__}


def from_json(text: str) -> dict[str, Any]:
    """Inverse of `to_json`; tuples become lists.

    Raises:
        ValueError: When the text was not written by it.
    """
    values = json.loads(text)
    if not isinstance(values, dict):
        raise ValueError("not an object")
    return {name: _value(entry) for name, entry in values.items()}


def _value(entry: Any) -> Any:
    if isinstance(entry, list):
        return [_value(each) for each in entry]
    if not isinstance(entry, dict):
        return entry
    if _OTHER in entry:
        return Malformed(str(entry[_OTHER]))
    kind = np.dtype(str(entry.get(_ARRAY)))
    if kind.kind not in "fiub":
        raise ValueError(f"arrays of {kind}")
    return np.array(entry.get("entries"), kind)
