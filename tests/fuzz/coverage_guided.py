"""Coverage-guided fuzzing of the steps with Atheris, no dependency: ``pip install atheris`` beside it.

    python tests/fuzz/coverage_guided.py -runs=100000 -seed=1 -max_len=512 -len_control=0 FOLDER_OF_CORPUS

The bytes of the fuzzer are the choices of the mutator. A violation ends the run with the inputs that caused it.
"""

from __future__ import annotations

import random
import sys
from pathlib import Path

import atheris  # pyright: ignore[reportMissingImports]

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "support")]
with atheris.instrument_imports(include=["ibvs_qp"]):
    from hostile import Mutator
    from hostile_flight import Flight
    from hostile_subjects import CONTROLLERS, PILOTS

SUBJECTS = [CONTROLLERS["assured"], CONTROLLERS["assured, bare"], PILOTS["supervised pilot"]]
#: Hostile steps per input of the fuzzer, and good ones before them.
STEPS, GOOD = 4, 3


class Choices(random.Random):
    """Choices by the bytes of the fuzzer; zeros when they are used up."""

    def __init__(self, data: bytes) -> None:
        super().__init__(0)
        self._provider = atheris.FuzzedDataProvider(data)

    def random(self) -> float:
        """One of 256 fractions."""
        return self._provider.ConsumeIntInRange(0, 255) / 256.0

    def getrandbits(self, k: int) -> int:
        """So many bits."""
        return self._provider.ConsumeIntInRange(0, 2**k - 1)

    def _randbelow(self, n: int) -> int:
        return self._provider.ConsumeIntInRange(0, n - 1)


#: One flight per subject; an input of the fuzzer continues it.
FLIGHTS = [Flight(subject, Mutator(random.Random(0), lies=True)) for subject in SUBJECTS]


def fuzz(data: bytes) -> None:
    """A few hostile steps of one subject."""
    choices = Choices(data)
    flight = FLIGHTS[choices.randrange(len(FLIGHTS))]
    if flight.left < STEPS + GOOD:
        flight.restart()
    flight.mutator = Mutator(choices, lies=True)
    flight.good(GOOD)
    for _ in range(STEPS):
        flight.hostile()


if __name__ == "__main__":
    atheris.Setup(sys.argv, fuzz)
    atheris.Fuzz()
