"""The finalists of a search: what they do on seeds and scenes that no trial flew, and which of them is chosen."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import polars as pl

from sim.sweep import run_sweep
from sim.sweep.engine import SweepProgress
from sim.sweep.parts import PARAM
from sim.tune.choice import (
    ALLOWED_WORSE_SCENE,
    DAMPING_KEPT,
    FINALISTS,
    allowed,
    contact_damping,
    gain_over,
    ranked,
)
from sim.tune.flights import CHOICE_SEED, checks, flights, scenes, seeds
from sim.tune.objectives import Score, score
from sim.tune.search import SearchPlan, start_gains
from sim.tune.space import with_gains

#: Name under which the shipped preset flies.
SHIPPED = "shipped"

Trials = dict[int, tuple[dict[str, float], Score]]


@dataclass(frozen=True)
class Finalist:
    """A preset on the seeds of the choice.

    Attributes:
        score: Over all scenes.
        scenes: By scene.
        damping: Least damping ratio of the contact.
    """

    score: Score
    scenes: dict[str, Score]
    damping: float

    def may_replace(self, shipped: Finalist) -> bool:
        """Whether it betters the shipped preset on the whole, and is clearly worse in no objective and no scene."""
        near = all(allowed(self.scenes[name], each, ALLOWED_WORSE_SCENE) for name, each in shipped.scenes.items())
        return near and allowed(self.score, shipped.score) and gain_over(self.score, shipped.score) < 0.0


def fly_finalists(
    plan: SearchPlan, trials: Trials, count: int, parts: Path, progress: SweepProgress
) -> dict[str, Finalist]:
    """Fly the best trials and the shipped preset on seeds of their own.

    Args:
        plan: The search.
        trials: What it found.
        count: Seeds per scene.
        parts: Where flights are kept.
        progress: Told about the flights.

    Returns:
        The shipped preset and every finalist, by name or number; empty when no trial came so far.

    Raises:
        KeyboardInterrupt: On Ctrl-C; what was flown is kept.
    """
    shipped = contact_damping(plan.shipped)
    better = ranked({number: each for number, (_, each) in trials.items()}, shipped_score(plan, trials))
    damped = {number: contact_damping(with_gains(plan.shipped, trials[number][0])) for number in better}
    best = [number for number in better if damped[number] >= DAMPING_KEPT * shipped][:FINALISTS]
    if not best:
        return {}
    presets = {SHIPPED: {}} | {str(number): trials[number][0] for number in best}
    table = fly_presets(plan, presets, seeds(CHOICE_SEED, plan.seed, count), parts, progress)
    dampings = {SHIPPED: shipped} | {str(number): damped[number] for number in best}
    return {name: _finalist(table.filter(pl.col("variant") == name), each) for name, each in dampings.items()}


def best_of(finalists: Mapping[str, Finalist]) -> int | None:
    """Number of the best finalist that may replace the shipped preset; None when none may."""
    good = {name: each for name, each in finalists.items() if each.may_replace(finalists[SHIPPED])}
    best = min(good, key=lambda name: gain_over(good[name].score, finalists[SHIPPED].score), default=None)
    return None if best is None else int(best)


def _finalist(rows: pl.DataFrame, damping: float) -> Finalist:
    names = rows[PARAM + "scene"].unique(maintain_order=True).to_list()
    by_scene = {name: score(rows.filter(pl.col(PARAM + "scene") == name).to_dicts()) for name in names}
    return Finalist(score(rows.to_dicts()), by_scene, damping)


def shipped_score(plan: SearchPlan, trials: Trials) -> Score:
    """Score of the shipped gains; they are the first trial of every search."""
    gains = start_gains(plan)
    return next((each for found, each in trials.values() if found == gains), trials[min(trials)][1])


def fly_presets(
    plan: SearchPlan, presets: Mapping[str, dict[str, float]], on_seeds: range, parts: Path, progress: SweepProgress
) -> pl.DataFrame:
    """Fly presets over all scenes, those of the search and the checks.

    Args:
        plan: The search.
        presets: Gains that differ from the shipped ones, by name of the preset.
        on_seeds: Seeds.
        parts: Where flights are kept.
        progress: Told about the flights.

    Raises:
        KeyboardInterrupt: On Ctrl-C; what was flown is kept.
    """
    flown, runs = scenes() | checks(), []
    for name, gains in presets.items():
        runs += flights(flown, with_gains(plan.shipped, gains), name, on_seeds, plan.features)
    result = run_sweep(runs, parts, workers=plan.jobs, progress=progress)
    if result.interrupted:
        raise KeyboardInterrupt
    return result.table
