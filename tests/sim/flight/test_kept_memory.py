"""Freed memory stays in the process."""

from __future__ import annotations

import resource
import subprocess
import sys

import pytest

CODE = """
import resource, sys
import numpy as np
from sim.flight.memory import keep_memory
kept = keep_memory() if sys.argv[1] == "kept" else False
for _ in range(3):
    parts = [np.ones(1 << 17) for _ in range(8)]
    del parts
before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
for _ in range(50):
    parts = [np.ones(1 << 17) for _ in range(8)]
    del parts
print(int(kept), resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)
"""


def faults(how: str) -> tuple[int, int]:
    """Whether the C library could be told, and page faults of arrays made and freed again and again."""
    command = [sys.executable, "-c", CODE, how]
    told, count = subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()
    return int(told), int(count)


def test_arrays_made_again_take_the_memory_of_those_freed() -> None:
    told, kept = faults("kept")
    if not told:
        pytest.skip("not glibc")
    pages = (8 << 20) // resource.getpagesize()
    assert kept < pages < faults("default")[1]
