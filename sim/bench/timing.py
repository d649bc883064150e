"""Times of one measured operation, and the result of a benchmark (schema 1)."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, TypeVar

import numpy as np

SCHEMA = 1
#: Rates whose missed deadlines are counted [Hz].
DEADLINES_HZ = (250, 500, 1000)
#: Percentiles of a row.
_PERCENTILES = {"p50_us": 50.0, "p90_us": 90.0, "p99_us": 99.0, "p999_us": 99.9}

Result = TypeVar("Result")


class Stopwatch:
    """Wraps calls and sums the wall-clock time of each stage [us]; the caller clears `spent`."""

    def __init__(self) -> None:
        self.spent: dict[str, float] = {}

    def around(self, stage: str, call: Callable[..., Any]) -> Callable[..., Any]:
        """The same call, timed."""

        def timed(*arguments: Any, **options: Any) -> Any:
            start = time.perf_counter_ns()
            result = call(*arguments, **options)
            self.spent[stage] = self.spent.get(stage, 0.0) + 1e-3 * (time.perf_counter_ns() - start)
            return result

        return timed


@dataclass(frozen=True, kw_only=True)
class Row:
    """Times of one operation."""

    name: str  # of the operation
    size: str | None = None  # picture size as in "640x480", or None
    # processor times of the measuring thread [us], in order; other processes disturb them least
    times_us: list[float] = field(default_factory=list)

    @property
    def median_us(self) -> float:
        """Median time [us]; NaN without times."""
        return float(np.median(self.times_us)) if self.times_us else float("nan")

    def measure(self, work: Callable[[], Result]) -> Result:
        """Call ``work``, record its time and return its result."""
        start = time.thread_time_ns()
        result = work()
        self.times_us.append(1e-3 * (time.thread_time_ns() - start))
        return result

    def summary(self) -> dict[str, Any]:
        """The row as written to JSON."""
        times = np.array(self.times_us if self.times_us else [np.nan])
        figures = {name: float(np.percentile(times, percent)) for name, percent in _PERCENTILES.items()}
        misses = {str(rate): int(np.count_nonzero(times > 1e6 / rate)) for rate in DEADLINES_HZ}
        return {"name": self.name, "size": self.size, **figures, "max_us": float(times.max()), "misses": misses}


@dataclass(frozen=True, kw_only=True)
class Bench:
    """Result of a benchmark: rows, medians of the stages [us], ratios of medians (rival to ours), further notes."""

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
