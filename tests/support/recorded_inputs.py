"""Inputs recorded in flight, of the replay test's cases, and walks through everything mutable in them."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Iterator
from typing import Any

import numpy as np

from tests.replay.cases import CASES, DATA
from tests.replay.recordings import Recording, load


@functools.cache
def recording(case: str) -> Recording:
    """What went into pilot and controller in one flight; not to be written."""
    return load(DATA / f"{CASES[case].inputs_of or case}.inputs.npz")


def arrays_in(value: Any) -> Iterator[np.ndarray]:
    """Every array inside a tree of dataclasses, lists and tuples."""
    if isinstance(value, np.ndarray):
        yield value
    elif dataclasses.is_dataclass(value) and not isinstance(value, type):
        for field in dataclasses.fields(value):
            yield from arrays_in(getattr(value, field.name))
    elif isinstance(value, list | tuple):
        for entry in value:
            yield from arrays_in(entry)


def overwrite(value: Any) -> int:
    """Write garbage into every array inside, as a caller does that uses its buffers again; how many there were."""
    count = 0
    for array in arrays_in(value):
        array.flags.writeable = True
        array[...] = np.nan if array.dtype.kind == "f" else 137
        count += 1
    return count
