"""Plain numbers of any input of a caller, or None for a refused one.

Accepted are integers and floats of Python and numpy, alone, in lists, tuples and plain arrays of the right shape. A
subclass of an array (masked, with units) is refused: its numbers may mean something else.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np

from ibvs_qp.validation.failure import type_name

FLOAT = np.dtype(float)

Read = TypeVar("Read")


def attempt(read: Callable[[Any], Read | None], value: Any) -> Read | None:
    """Result of reading a value; None if it raises anything."""
    try:
        return read(value)
    except Exception:  # of a class of the caller's
        return None


def whole(value: Any, low: int, high: int) -> int | None:
    """A whole number within [low, high] as a plain integer."""
    if type(value) is not int:
        value = attempt(_integer, value)
    return value if value is not None and low <= value <= high else None


def _integer(value: Any) -> int | None:
    if not isinstance(value, (int, np.integer)) or isinstance(value, bool):
        return None
    plain = int(value)
    return plain if type(plain) is int else None


def number(value: Any) -> float | None:
    """A number, maybe NaN or infinite, as a float; None for an integer beyond every float."""
    return value if type(value) is float else attempt(_float, value)


def _float(value: Any) -> float | None:
    if not isinstance(value, (int, float, np.integer, np.floating)) or isinstance(value, bool):
        return None
    return float(value)


def vector(value: Any, size: int) -> list[float] | None:
    """Entries of an array, list or tuple of that many numbers."""
    if type(value) is np.ndarray:
        if value.shape != (size,) or value.dtype.kind not in "fiu":
            return None
        return value.astype(float).tolist()
    if type(value) not in (list, tuple) or len(value) != size:
        return None
    entries = [number(entry) for entry in value]
    return None if None in entries else entries  # type: ignore[return-value]


def matrix(value: Any, size: int) -> np.ndarray | None:
    """A square array of numbers, any of them NaN or infinite, (size, size); the same value if it is plain."""
    if type(value) is np.ndarray:
        if value.shape != (size, size) or value.dtype.kind not in "fiu":
            return None
        return value.astype(float, copy=False)
    if type(value) not in (list, tuple) or len(value) != size:
        return None
    rows = [vector(row, size) for row in value]
    return None if None in rows else np.array(rows)


def text(value: Any) -> str | None:
    """A text as a plain one: a subclass may have no hash."""
    return value if type(value) is str else str.__str__(value) if issubclass(type(value), str) else None


def described(value: Any) -> str:
    """Type of a refused value, of a plain array also its entries and shape, in a few words."""
    if type(value) is np.ndarray:
        return f"array of {str(value.dtype)[:20]} with shape {str(value.shape)[:40]}"
    return type_name(value)
