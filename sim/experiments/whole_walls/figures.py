"""Figures of the flights over whole walls, each with its goal and number of flights, and the flights that failed."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import polars as pl

from sim.evaluate.truth import Assessment
from sim.experiments.whole_walls.flights import EARLY_STROKE
from sim.flight.trace_log import load_trace
from sim.sweep.design import Run
from sim.sweep.parts import PARAM
from sim.world.worlds import HARSH

#: Least fraction of complete flights by set; the sets with faults have no such goal.
COMPLETE_GOAL = {"datasheet": 1.0, HARSH: 0.9, "rendered": 1.0}
#: Least coverage of a flight, and largest place error of the last strokes as a multiple of that of an early one [-].
COVERAGE_GOAL, PLACE_GOAL = 0.98, 2.0
#: Sets with these two goals.
_COVERED = ("datasheet", "rendered")
#: Most false claims, and least fraction of the complete flights that are claimed.
FALSE_GOAL, CLAIMED_GOAL = 0, 0.98


@dataclass(frozen=True, kw_only=True)
class Line:
    """One figure."""

    figure: str
    value: float
    goal: float | None  # None: it has none
    at_least: bool = True  # whether the goal is a lower bound
    n: int  # flights behind it
    planned: int  # flights of the design
    percent: bool = False  # whether value and goal are shares

    @property
    def met(self) -> bool:
        """Whether the goal is met, as far as flights were flown."""
        if self.goal is None or not self.n:
            return True
        return self.value >= self.goal if self.at_least else self.value <= self.goal

    @property
    def cells(self) -> tuple[str, ...]:
        """Figure, value, goal, n, and whether the goal is met."""
        scale, unit, digits = (100.0, " %", ".1f") if self.percent else (1.0, "", ".3g")
        goal = "–" if self.goal is None else f"{'>=' if self.at_least else '<='} {scale * self.goal:g}{unit}"
        value = "–" if math.isnan(self.value) else f"{scale * self.value:{digits}}{unit}"
        met = "–" if self.goal is None or not self.n else "yes" if self.met else "NO"
        return self.figure, value, goal, f"{self.n} of {self.planned}", met


def lines(table: pl.DataFrame, runs: Sequence[Run]) -> list[Line]:
    """Every figure of the flown rows of a design."""
    found: list[Line] = []
    for name, law in dict.fromkeys((run.experiment, run.law) for run in runs):
        planned = [run for run in runs if (run.experiment, run.law) == (name, law)]
        rows = table.filter((pl.col("experiment") == name) & (pl.col("law") == law))
        found += _of_set(name, law, rows, planned)
    done, claimed = _done(table), table["claimed"]
    complete = int(done.sum())
    return [
        *found,
        Line(
            figure="false claims",
            value=float((claimed & ~done).sum()),
            goal=FALSE_GOAL,
            at_least=False,
            n=table.height,
            planned=len(runs),
        ),
        Line(
            figure="claimed, of the complete flights",
            value=_share(int((claimed & done).sum()), complete),
            goal=CLAIMED_GOAL,
            n=complete,
            planned=len(runs),
            percent=True,
        ),
    ]


def _of_set(name: str, law: str, rows: pl.DataFrame, planned: Sequence[Run]) -> Iterator[Line]:
    words, goal, total, done = f"{name}, {law}", COMPLETE_GOAL.get(name), len(planned), _done(rows)
    share = _share(int(done.sum()), rows.height)
    yield Line(figure=f"{words}: complete", value=share, goal=goal, n=rows.height, planned=total, percent=True)
    if name not in _COVERED:
        return
    covered = _column(rows, "coverage").fill_nan(0.0).fill_null(0.0)
    least = float(covered.min()) if rows.height else math.nan  # type: ignore[arg-type]
    yield Line(
        figure=f"{words}: coverage, least", value=least, goal=COVERAGE_GOAL, n=rows.height, planned=total, percent=True
    )
    many = pl.col(f"{PARAM}strokes") > EARLY_STROKE
    later = rows.filter(many) if rows.height else rows
    places = [_median(_column(later, name)) for name in ("place_early_m", "place_last_m")]
    yield Line(
        figure=f"{words}: place error of the last stroke over that of stroke {EARLY_STROKE}, medians",
        value=places[1] / places[0] if places[0] else math.nan,
        goal=PLACE_GOAL,
        at_least=False,
        n=later.height,
        planned=sum(run.params["strokes"] > EARLY_STROKE for run in planned),  # type: ignore[operator]
    )


def failures(table: pl.DataFrame, folder: Path) -> Iterator[str]:
    """Every flight that is not complete and claimed, in one line each: place, claim of the pilot, truth."""
    for row, done in zip(table.iter_rows(named=True), _done(table), strict=True):
        covered = row.get("coverage") or 0.0
        gaps = done and row["experiment"] in _COVERED and covered < COVERAGE_GOAL
        if done and row["claimed"] and not gaps:
            continue
        job = " ".join(f"{name.removeprefix(PARAM)}={row[name]}" for name in row if name.startswith(PARAM))
        found = f"{row['experiment']}, {row['variant']}, {row['law']}, seed {row['seed']} ({job}): {row['reason']}"
        found += f"; covers {100.0 * covered:.1f} %" if gaps else ""
        if not row["claimed"] and not done and row["trace"]:
            found += f"; by the truth: {Assessment(load_trace(folder / row['trace'])).shortfall}"
        yield found


def _column(rows: pl.DataFrame, name: str) -> pl.Series:
    """A figure, null where no flight has it."""
    if name in rows.columns:
        return rows[name]
    return pl.Series(name, [None] * rows.height, dtype=pl.Float64)


def _done(rows: pl.DataFrame) -> pl.Series:
    """Whether the truth completes each flight; a flight that was refused or failed inside has no truth."""
    return _column(rows, "done").fill_null(0.0) > 0.5


def _share(count: float, total: int) -> float:
    return count / total if total else math.nan


def _median(values: pl.Series) -> float:
    """Of the magnitudes; NaN without any."""
    median = values.abs().fill_nan(None).median()
    return math.nan if median is None else float(median)  # type: ignore[arg-type]
