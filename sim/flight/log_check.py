"""Shape, type and range of the arrays of a log, before anything computes with them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from sim.flight.trace import FIELDS

#: Arrays of indices and the arrays of names that they point into.
_INDICES = {"phase": "phases", "outcome": "outcomes"}
#: Arrays of names.
_NAMES = {*_INDICES.values(), "limits"}


def check_arrays(arrays: Mapping[str, np.ndarray]) -> None:
    """Check the arrays of one law against `FIELDS`; arrays that an older log lacks are no error.

    Raises:
        ValueError: Naming the array.
    """
    if "t" not in arrays:
        raise ValueError("array t is missing")
    sizes: dict[str, int] = {}
    for name in FIELDS.keys() & arrays.keys():
        array, letters = arrays[name], _letters(name)
        fixed = tuple(int(x) if x.isdigit() else sizes.setdefault(x, n) for x, n in zip(letters, array.shape))  # noqa: B905
        if array.dtype.kind not in "biuf" or len(letters) != array.ndim or fixed != array.shape:
            needed = ", ".join(f"{x} = {sizes[x]}" if x in sizes else x for x in letters)
            raise ValueError(f"array {name} has shape {array.shape} of {array.dtype}, needed are numbers ({needed})")
    for name in _NAMES & arrays.keys():
        array = arrays[name]
        if array.ndim != 1 or array.dtype.kind != "U":
            raise ValueError(f"array {name} has shape {array.shape} of {array.dtype}, expected a list of names")
    if sizes.get("L", 0) < len(arrays["limits"]):
        raise ValueError(f"{len(arrays['limits'])} limits are named, the arrays have {sizes.get('L', 0)} columns")
    if not (np.isfinite(arrays["t"]).all() and (np.diff(arrays["t"]) > 0.0).all()):
        raise ValueError("array t does not increase")
    for name, names in _INDICES.items():
        if name in arrays and not np.isin(arrays[name], np.arange(len(arrays[names]))).all():
            raise ValueError(f"array {name} has an index outside {names}")


def _letters(name: str) -> list[str]:
    """Sizes of an array in the words of `FIELDS`: "(N,3) true ..." has N and 3."""
    return [letter for letter in FIELDS[name][1:].split(")")[0].split(",") if letter]
