"""Independent seeded random streams: one per purpose, so that adding a noise never changes another."""

from __future__ import annotations

import zlib

import numpy as np


def stream(seed: int, purpose: str) -> np.random.Generator:
    """Random generator of one purpose of one flight, e.g. ``stream(3, "imu")``; same arguments, same bits."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(zlib.crc32(purpose.encode()),)))
