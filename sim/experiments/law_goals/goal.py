"""One goal: a bound of a figure over flights, or of the median ratio to the flights of before with the same seeds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import polars as pl

from ibvs_qp.config.errors import ConfigError
from ibvs_qp.config.settings import choice, validate
from sim.evaluate.figures import figure_of
from sim.sweep.paired import exact_interval
from sim.sweep.parts import PARAM


@dataclass(frozen=True, kw_only=True)
class Goal:
    """A line of ``goals.toml``; exactly one bound is stated."""

    kind: str  # of the flights
    world: str
    figure: str  # of the registry
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
        before: Median of before.
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
        name = f"{goal.kind}, {goal.world}: {figure.words}{', ' if figure.unit else ''}{figure.unit}"
        low, high = self.interval
        ratio = "–" if np.isnan(self.ratio) else f"{self.ratio:.2f} ({low:.2f} to {high:.2f})"
        bounds = {"ratio <=": goal.ratio_at_most, "<=": goal.at_most, ">=": goal.at_least}
        words, value = next((words, value) for words, value in bounds.items() if value is not None)
        bound = f"{words} {value * (1.0 if words.startswith('ratio') else figure.scale):g}"
        numbers = ["–" if np.isnan(value) else f"{value * figure.scale:.3g}" for value in (self.before, self.now)]
        return name, *numbers, ratio, bound, f"{self.n} of {self.planned}", "yes" if self.met else "NO"


def outcome(goal: Goal, flown: pl.DataFrame, before: pl.DataFrame, planned: int) -> Outcome:
    """Compare the flights of a goal with those of before, seed by seed.

    Args:
        goal: The goal.
        flown: Table of today's flights.
        before: Flights of before, columns kind, world, seed and figures.
        planned: Flights of the design.
    """
    old = before.filter((pl.col("kind") == goal.kind) & (pl.col("world") == goal.world))
    column = pl.col(goal.figure).cast(float) if goal.figure in old.columns else pl.lit(None, pl.Float64)
    old = old.select("seed", column.alias("before"))
    if not {goal.figure, f"{PARAM}kind"} <= set(flown.columns):
        columns = {f"{PARAM}kind": str, f"{PARAM}world": str, "seed": int, "completed": bool, goal.figure: float}
        flown = pl.DataFrame(schema=columns)
    mine = flown.filter((pl.col(f"{PARAM}kind") == goal.kind) & (pl.col(f"{PARAM}world") == goal.world))
    counted = mine.filter(pl.col("completed")) if goal.of == "median" else mine
    now = counted.select("seed", pl.col(goal.figure).cast(float).alias("now"))
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


def _median(values: pl.Series) -> float:
    found = values.drop_nulls().to_numpy()
    return float(np.median(found)) if len(found) else float("nan")


def _mean(values: pl.Series) -> float:
    return float(values.to_numpy().mean()) if len(values) else float("nan")


def _largest(values: pl.Series) -> float:
    return float(values.to_numpy().max()) if len(values) else float("nan")


#: Figure of the flights by `Goal.of`.
_SUMMARY = {"median": _median, "mean": _mean, "largest": _largest}
