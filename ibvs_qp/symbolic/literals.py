"""Python numbers as C literals and tables."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np


def real(value: float, single: bool) -> str:
    """A finite number in one precision."""
    text = f"{np.float32(value):.9g}" if single else f"{float(value):.17g}"
    if not any(letter in text for letter in ".e"):
        text += ".0"
    return text + ("f" if single else "")


def reals(values: Iterable[float], single: bool) -> str:
    """Entries of an initialiser."""
    return ", ".join(real(value, single) for value in values)


def table(kind: str, name: str, values: np.ndarray | Sequence[float], single: bool) -> str:
    """Definition of a constant array of one or two dimensions."""
    array = np.asarray(values)
    size = "".join(f"[{length}]" for length in array.shape)
    rows = [reals(row, single) if kind == "ibvs_real" else _integers(row) for row in np.atleast_2d(array)]
    body = ", ".join(f"{{{row}}}" for row in rows) if array.ndim == 2 else rows[0]
    return f"const {kind} {name}{size} = {{{body}}};"


def _integers(values: Iterable[float]) -> str:
    return ", ".join(str(int(value)) for value in values)
