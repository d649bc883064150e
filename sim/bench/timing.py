"""Times of one measured thing, and the table of a bench (schema 1)."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, TypeVar

import numpy as np

SCHEMA = 1
#: Rates whose deadlines are watched [Hz].
DEADLINES_HZ = (250, 500, 1000)
#: Percentiles of a row.
_PERCENTILES = {"p50_us": 50.0, "p90_us": 90.0, "p99_us": 99.0, "p999_us": 99.9}

Result = TypeVar("Result")


@dataclass(frozen=True, kw_only=True)
class Row:
    """Times of one thing.

    Attributes:
        name: What was measured.
        size: Picture size as in "640x480", or None.
        times_us: Times of the measuring thread [us], in order: neighbours on the machine disturb them least.
    """

    name: str
    size: str | None = None
    times_us: list[float] = field(default_factory=list)

    @property
    def median_us(self) -> float:
        """Median time [us]; not a number without any."""
        return float(np.median(self.times_us)) if self.times_us else float("nan")

    def measure(self, work: Callable[[], Result]) -> Result:
        """Do some work and note how long it took."""
        start = time.thread_time_ns()
        result = work()
        self.times_us.append(1e-3 * (time.thread_time_ns() - start))
        return result

    def summary(self) -> dict[str, Any]:
        """The row as written to JSON."""
        times = np.array(self.times_us if self.times_us else [np.nan])
        figures = {name: float(np.percentile(times, share)) for name, share in _PERCENTILES.items()}
        misses = {str(rate): int(np.count_nonzero(times > 1e6 / rate)) for rate in DEADLINES_HZ}
        return {"name": self.name, "size": self.size, **figures, "max_us": float(times.max()), "misses": misses}


@dataclass(frozen=True, kw_only=True)
class Bench:
    """A whole bench: rows, medians of the stages [us], ratios of medians (rival to ours), and what else to know."""

    rows: list[Row]
    stages_us: dict[str, float]
    ratios: dict[str, float]
    notes: dict[str, Any] = field(default_factory=dict)

    def summary(self) -> dict[str, Any]:
        """The bench as written to JSON."""
        return {
            "schema": SCHEMA,
            "rows": [row.summary() for row in self.rows],
            "stages_us": self.stages_us,
            "ratios": self.ratios,
            **self.notes,
        }
