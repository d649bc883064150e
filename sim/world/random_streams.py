"""Independent seeded random streams: one per purpose, so that adding a noise never changes another."""

from __future__ import annotations

import zlib
from collections.abc import Iterator, Sequence

import numpy as np

#: Normal numbers drawn at once: a call of the generator costs as much as a hundred numbers [-].
BLOCK = 512


def stream(seed: int, purpose: str) -> np.random.Generator:
    """Random generator of one purpose of one flight, e.g. ``stream(3, "imu")``; same arguments, same bits."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(zlib.crc32(purpose.encode()),)))


class Normals:
    """Standard normal numbers of a generator, drawn in blocks: the same numbers in the same order as one by one.

    Args:
        generator: Source; no other code may draw from it.
    """

    def __init__(self, generator: np.random.Generator) -> None:
        self._generator = generator
        self._block: list[float] = []
        self._next = 0

    def take(self, count: int) -> list[float]:
        """The next numbers, as plain floats."""
        start, self._next = self._next, self._next + count
        if self._next > len(self._block):
            self._block = self._block[start:] + self._generator.standard_normal(max(BLOCK, count)).tolist()
            start, self._next = 0, count
        return self._block[start : self._next]


class NormalRows:
    """Rows of standard normal numbers, a few of each of several generators: the same numbers as one by one.

    Args:
        generators: Sources; no other code may draw from them.
        each: Numbers of each generator in a row.
    """

    def __init__(self, generators: Sequence[np.random.Generator], each: int) -> None:
        self._generators, self._each = tuple(generators), each
        self._rows: Iterator[np.ndarray] = iter(())

    def take(self) -> np.ndarray:
        """The next row, (numbers,)."""
        row = next(self._rows, None)
        if row is None:
            shape = (BLOCK // self._each, self._each)
            self._rows = iter(np.hstack([source.standard_normal(shape) for source in self._generators]))
            row = next(self._rows)
        return row
