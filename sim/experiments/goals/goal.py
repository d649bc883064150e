"""One goal: a bound of a figure over flights, or of its median ratio to reference flights with the same seeds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import polars as pl

from ibvs_qp.config.errors import ConfigError
from ibvs_qp.config.settings import choice, validate
from sim.evaluate.figures import figure_of
from sim.sweep.design import Run
from sim.sweep.paired import exact_interval
from sim.sweep.parts import PARAM


@dataclass(frozen=True, kw_only=True)
class Goal:
    """A line of ``goals.toml``; exactly one bound is stated."""

    kind: str  # of the flights
    figure: str  # of the registry
    world: str = ""  # of the flights; empty: of the set
    law: str = "qp"  # of the flights
    against: str = ""  # kind of the reference flights of a ratio, same world and law; empty: the flights of before
    ratio_at_most: float | None = None
    at_most: float | None = None  # in SI
    at_least: float | None = None
    of: str = choice(
        "median",
        "median of the flights that completed, or mean or largest value of all",
        ("median", "mean", "largest"),
    )

    def __post_init__(self) -> None:
        """One bound."""
        validate(self)
        if sum(bound is not None for bound in (self.ratio_at_most, self.at_most, self.at_least)) != 1:
            raise ConfigError(f"goal of {self.figure}, {self.kind}: state one of ratio_at_most, at_most, at_least")
        if self.of != "median" and self.ratio_at_most is not None:
            raise ConfigError(f"goal of {self.figure}, {self.kind}: a ratio is that of the median")
        if self.of == "largest" and self.at_least is not None:
            raise ConfigError(f"goal of {self.figure}, {self.kind}: the largest value has an upper bound")


@dataclass(frozen=True, kw_only=True)
class Goals:
    """Content of ``goals.toml``."""

    goals: tuple[Goal, ...]


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """Result of the flights for a goal, in SI, NaN without data; the ratio with its exact interval.

    Attributes:
        goal: The goal.
        before: Median of the reference flights.
        now: Median of the flights that completed, or the figure of the goal.
        ratio: Median ratio of pairs with the same seed.
        interval: Of that median.
        n: Flights with the figure, pairs for a ratio.
        planned: Flights of the design.
    """

    goal: Goal
    before: float
    now: float
    ratio: float
    interval: tuple[float, float]
    n: int
    planned: int

    @property
    def met(self) -> bool:
        """Whether every flight of the design has the figure, for a median is complete, and the goal is met."""
        goal = self.goal
        if self.n < self.planned:
            return False
        if goal.ratio_at_most is not None:
            return self.ratio <= goal.ratio_at_most
        if goal.at_most is not None:
            return self.now <= goal.at_most
        assert goal.at_least is not None
        return self.now >= goal.at_least

    @property
    def cells(self) -> tuple[str, ...]:
        """Flights and figure, before, now, ratio with its interval, goal, n, and whether it is met."""
        goal, figure = self.goal, figure_of(self.goal.figure)
        cell = ", ".join(filter(None, (goal.kind, goal.world, goal.law)))
        name = f"{cell}: {figure.words}{', ' if figure.unit else ''}{figure.unit}"
        low, high = self.interval
        ratio = "–" if np.isnan(self.ratio) else f"{self.ratio:.2f} ({low:.2f} to {high:.2f})"
        bounds = {"ratio <=": goal.ratio_at_most, "<=": goal.at_most, ">=": goal.at_least}
        words, value = next((words, value) for words, value in bounds.items() if value is not None)
        bound = f"{words} {value * (1.0 if words.startswith('ratio') else figure.scale):g}"
        numbers = ["–" if np.isnan(value) else f"{value * figure.scale:.3g}" for value in (self.before, self.now)]
        return name, *numbers, ratio, bound, f"{self.n} of {self.planned}", "yes" if self.met else "NO"


def flights_of(goal: Goal, runs: Sequence[Run]) -> list[Run]:
    """Flights of a design that count for a goal."""
    cell = {name: value for name, value in (("kind", goal.kind), ("world", goal.world)) if value}
    return [run for run in runs if cell.items() <= run.params.items() and run.law == goal.law]


def outcome(goal: Goal, flown: pl.DataFrame, before: pl.DataFrame | None, planned: int) -> Outcome:
    """Compare the flights of a goal with the reference flights, seed by seed.

    Args:
        goal: The goal.
        flown: Table of today's flights.
        before: Flights of before, columns kind, world, seed and figures; None without any.
        planned: Flights of the design.
    """
    mine = _cell(goal, goal.kind, flown)
    if goal.against:
        old = _cell(goal, goal.against, flown).filter("completed")
    else:
        old = _cell(goal, goal.kind, pl.DataFrame() if before is None else before)
    old = old.select("seed", pl.col(goal.figure).alias("before"))
    counted = mine.filter("completed") if goal.of == "median" else mine
    now = counted.select("seed", pl.col(goal.figure).alias("now"))
    now = now.filter(pl.col("now").is_finite())
    both = now.join(old, on="seed")
    ratios = (both["now"] / both["before"]).to_numpy()
    ratios = ratios[np.isfinite(ratios)]
    return Outcome(
        goal=goal,
        before=_median(old["before"]),
        now=_SUMMARY[goal.of](now["now"]),
        ratio=float(np.median(ratios)) if len(ratios) else float("nan"),
        interval=exact_interval(ratios) if len(ratios) else (float("nan"), float("nan")),
        n=len(ratios) if goal.ratio_at_most is not None else now.height,
        planned=planned,
    )


def _cell(goal: Goal, kind: str, table: pl.DataFrame) -> pl.DataFrame:
    """Flights of a kind in the goal's world under its law: columns seed, completed and the figure.

    Args:
        goal: The goal.
        kind: Kind of the flights.
        table: Flights of a sweep, or of before: without laws, they are the QP's and complete.
    """
    columns = {"seed": pl.Int64(), "completed": pl.Boolean(), goal.figure: pl.Float64()}
    table = table.rename({f"{PARAM}kind": "kind", f"{PARAM}world": "world"}, strict=False)
    if table.is_empty():
        return pl.DataFrame(schema=columns)
    for column, value in (("kind", kind), ("world", goal.world), ("law", goal.law)):
        if value and column in table.columns:
            table = table.filter(pl.col(column) == value)
    return table.select(
        (pl.col(name) if name in table.columns else pl.lit(True if name == "completed" else None))
        .cast(kind_of)
        .alias(name)
        for name, kind_of in columns.items()
    )


def _median(values: pl.Series) -> float:
    found = values.drop_nulls().to_numpy()
    return float(np.median(found)) if len(found) else float("nan")


def _mean(values: pl.Series) -> float:
    return float(values.to_numpy().mean()) if len(values) else float("nan")


def _largest(values: pl.Series) -> float:
    return float(values.to_numpy().max()) if len(values) else float("nan")


#: Figure of the flights by `Goal.of`.
_SUMMARY = {"median": _median, "mean": _mean, "largest": _largest}
