"""Independent seeded random streams: one per purpose, so that adding a noise never changes another."""

from __future__ import annotations

import zlib

import numpy as np

#: Normal numbers drawn at once: a call of the generator costs as much as a hundred numbers.
BLOCK = 512


def stream(seed: int, purpose: str) -> np.random.Generator:
    """Random generator of one purpose of one flight, e.g. ``stream(3, "imu")``; same arguments, same bits."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(zlib.crc32(purpose.encode()),)))


class Normals:
    """Standard normal numbers of a generator, drawn in blocks: the same numbers in the same order as one by one.

    Args:
        generator: Source; nobody else may draw from it any more.
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
