"""Figures of the flights over whole walls, each with its bound and number of flights, and the flights that failed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import polars as pl

from sim.evaluate.truth import Assessment
from sim.experiments.spec import EVERY, Criterion
from sim.experiments.verdict import Verdict, evaluate
from sim.experiments.whole_walls.flights import EARLY_STROKE
from sim.flight.trace_log import load_trace
from sim.sweep.design import Run
from sim.sweep.parts import PARAM
from sim.world.worlds import HARSH

#: Least coverage of a flight, and largest place error of the last strokes as a multiple of that of an early one [-].
COVERAGE_GOAL, PLACE_GOAL = 0.98, 2.0


def _every(text: str, metric: str, share: float = 1.0, **bound: Any) -> Criterion:
    return Criterion(text=text, metric=metric, statistic=EVERY, share=share, include_failed=True, **bound)


def _complete(share: float) -> Criterion:
    return _every("complete", "done", share, at_least=1.0)


_COVERED = (
    _every("coverage", "coverage", at_least=COVERAGE_GOAL),
    Criterion(text=f"place error of the last stroke over that of stroke {EARLY_STROKE}", metric="place_growth",
              at_most=PLACE_GOAL, share=0.0, include_failed=True),
)  # fmt: skip
#: Bounds by set, under each law; the sets with faults have none.
BOUNDS = {
    "datasheet": (_complete(1.0), *_COVERED),
    HARSH: (_complete(0.9),),
    "rendered": (_complete(1.0), *_COVERED),
}
#: Bounds of the pilot's claims over all flights, and over the complete ones.
FALSE_CLAIMS = _every("false claims", "false_claim", at_most=0.0)
CLAIMED = _every("claimed, of the complete flights", "claimed", 0.98, at_least=1.0)


@dataclass(frozen=True)
class Line:
    """A bound over the flown flights of a set."""

    words: str
    verdict: Verdict
    planned: int  # flights of the design

    @property
    def met(self) -> bool:
        """Whether the bound is met, as far as flights were flown."""
        return self.verdict.met or not self.verdict.n

    @property
    def cells(self) -> tuple[str, ...]:
        """Figure, bound, median, worst flight, flights within the bound, and whether it is met."""
        verdict, criterion = self.verdict, self.verdict.criterion
        share = f" in {100.0 * criterion.share:.0f} %" if criterion.every else ""
        bound = f"{'>=' if criterion.least else '<='} {verdict.bound:g}{share}"
        flown = f"{verdict.within} of {verdict.known}, {self.planned} planned"
        met = "–" if not verdict.n else "yes" if self.met else "NO"
        return self.words, bound, f"{verdict.median:.3g}", f"{verdict.worst:.3g}", flown, met


def outcomes(table: pl.DataFrame, runs: Sequence[Run]) -> list[Line]:
    """Every bound over the flown rows of a design."""
    table, found = _with_truth(table), []
    for name, law in dict.fromkeys((run.experiment, run.law) for run in runs):
        planned = sum((run.experiment, run.law) == (name, law) for run in runs)
        rows = table.filter((pl.col("experiment") == name) & (pl.col("law") == law))
        for bound in BOUNDS.get(name, (_complete(0.0),)):
            found.append(Line(f"{name}, {law}: {bound.text}", evaluate(bound, {}, rows, {}), planned))
    for bound, rows in ((FALSE_CLAIMS, table), (CLAIMED, table.filter(pl.col("done") > 0.5))):
        found.append(Line(bound.text, evaluate(bound, {}, rows, {}), len(runs)))
    return found


def failures(table: pl.DataFrame, folder: Path) -> Iterator[str]:
    """Every flight that is not complete and claimed, in one line each: place, claim of the pilot, truth."""
    for row in _with_truth(table).iter_rows(named=True):
        covered, done = row.get("coverage") or 0.0, row["done"] > 0.5
        gaps = done and _COVERED[0] in BOUNDS.get(row["experiment"], ()) and covered < COVERAGE_GOAL
        if done and row["claimed"] and not gaps:
            continue
        job = " ".join(f"{name.removeprefix(PARAM)}={row[name]}" for name in row if name.startswith(PARAM))
        found = f"{row['experiment']}, {row['variant']}, {row['law']}, seed {row['seed']} ({job}): {row['reason']}"
        found += f"; covers {100.0 * covered:.1f} %" if gaps else ""
        if not row["claimed"] and not done and row["trace"]:
            found += f"; by the truth: {Assessment(load_trace(folder / row['trace'])).shortfall}"
        yield found


def _with_truth(table: pl.DataFrame) -> pl.DataFrame:
    """The table with whether the truth completes each flight, 0 for a refused one, and false claims."""
    if "done" not in table.columns:
        table = table.with_columns(done=pl.lit(None, pl.Float64))
    done = pl.col("done").fill_null(0.0)
    return table.with_columns(done=done, false_claim=(pl.col("claimed") & (done < 0.5)).cast(float))
