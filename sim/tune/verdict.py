"""Shipped against tuned on seeds that the search never saw: the same flights under both, difference by difference."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from sim.sweep import run_sweep
from sim.sweep.engine import SweepProgress
from sim.sweep.parts import PARAM
from sim.sweep.statistics import median_interval
from sim.tune.choice import FINALISTS, allowed, gain_over, ranked
from sim.tune.flights import CHOICE_SEED, REPORT_SEED, flights, seeds
from sim.tune.objectives import OBJECTIVES, Score, score
from sim.tune.search import SearchPlan
from sim.tune.space import searched_gains, with_gains

#: Names under which the shipped and the chosen preset fly.
SHIPPED, TUNED = "shipped", "tuned"

Trials = dict[int, tuple[dict[str, float], Score]]


@dataclass(frozen=True)
class Choice:
    """The finalists on the seeds of the choice.

    Attributes:
        chosen: Trial that takes the shipped preset's place; None when that stays.
        scores: Of the shipped preset and of every finalist, by name or number; empty when no trial came so far.
    """

    chosen: int | None
    scores: dict[str, Score]


def choose(plan: SearchPlan, trials: Trials, count: int, parts: Path, progress: SweepProgress) -> Choice:
    """Fly the best trials and the shipped preset on seeds of their own and choose one.

    Args:
        plan: The search.
        trials: What it found.
        count: Seeds per scene.
        parts: Where flights are kept.
        progress: Told about the flights.

    Raises:
        KeyboardInterrupt: On Ctrl-C; what was flown is kept.
    """
    best = ranked({number: each for number, (_, each) in trials.items()}, shipped_score(plan, trials))[:FINALISTS]
    if not best:
        return Choice(None, {})
    chosen = seeds(CHOICE_SEED, plan.seed, count)
    runs = flights(plan.shipped, SHIPPED, chosen, plan.features)
    for number in best:
        runs += flights(with_gains(plan.shipped, trials[number][0]), str(number), chosen, plan.features)
    table = _fly(runs, parts, plan.jobs, progress)
    names = table["variant"].unique(maintain_order=True)
    scores = {name: score(table.filter(pl.col("variant") == name).to_dicts()) for name in names}
    good = [number for number in best if allowed(scores[str(number)], scores[SHIPPED])]
    good = [number for number in good if gain_over(scores[str(number)], scores[SHIPPED]) < 0.0]
    best_of = min(good, key=lambda number: gain_over(scores[str(number)], scores[SHIPPED]), default=None)
    return Choice(best_of, scores)


def shipped_score(plan: SearchPlan, trials: Trials) -> Score:
    """Score of the shipped gains; they are the first trial of every search."""
    gains = searched_gains(plan.shipped)
    return next((each for found, each in trials.values() if found == gains), trials[min(trials)][1])


def unseen(plan: SearchPlan, gains: dict[str, float], count: int, parts: Path, progress: SweepProgress) -> pl.DataFrame:
    """Flights of the shipped and of the chosen preset on the seeds of the report."""
    chosen = seeds(REPORT_SEED, plan.seed, count)
    runs = flights(plan.shipped, SHIPPED, chosen, plan.features)
    runs += flights(with_gains(plan.shipped, gains), TUNED, chosen, plan.features)
    return _fly(runs, parts, plan.jobs, progress)


def _fly(runs: Sequence[Any], parts: Path, jobs: int, progress: SweepProgress) -> pl.DataFrame:
    result = run_sweep(runs, parts, workers=jobs, progress=progress)
    if result.interrupted:
        raise KeyboardInterrupt
    return result.table


def paired(table: pl.DataFrame) -> pl.DataFrame:
    """One row per scene and seed with the figures of both presets, those of the tuned one suffixed ``.tuned``."""
    first, second = (table.filter(pl.col("variant") == name) for name in (SHIPPED, TUNED))
    return first.join(second, on=[PARAM + "scene", "seed"], suffix=f".{TUNED}", maintain_order="left")


def differences(table: pl.DataFrame) -> list[dict[str, Any]]:
    """Tuned minus shipped, flight by flight, over all scenes and for each.

    Returns:
        Per scene ("all" first) and objective: n, medians of both, median of the differences with its interval, and
        a verdict: "better", "worse", or "same" where the interval holds zero.
    """
    both = paired(table)
    names = both[PARAM + "scene"].unique(maintain_order=True).to_list()
    result = []
    for scene in ("all", *names):
        rows = both if scene == "all" else both.filter(pl.col(PARAM + "scene") == scene)
        for each in OBJECTIVES:
            before, after = (rows[name].cast(pl.Float64).to_numpy() for name in (each.column, f"{each.column}.{TUNED}"))
            change = median_interval(after - before)
            verdict = "better" if change["high"] < 0.0 else "worse" if change["low"] > 0.0 else "same"
            result.append(
                {
                    "scene": scene,
                    "objective": each.column,
                    "n": int(np.isfinite(after - before).sum()),
                    "shipped": median_interval(before)["median"],
                    "tuned": median_interval(after)["median"],
                    "difference": change,
                    "verdict": verdict,
                }
            )
    return result
