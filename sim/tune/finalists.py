"""Flights beyond the search: finalists on other seeds and harder scenes, and the chosen preset on unseen seeds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import polars as pl

from sim.sweep import run_sweep
from sim.sweep.engine import SweepProgress
from sim.sweep.parts import PARAM
from sim.tune.flights import CHOICE_SEED, REPORT_SEED, checks, flights, seeds, training
from sim.tune.objectives import (
    FINALISTS,
    LEAST_DAMPING,
    SCENE_ROOM,
    Score,
    allowed,
    contact_damping,
    gain_over,
    ranked,
    score,
)
from sim.tune.search import SearchPlan, Trials, start_gains
from sim.tune.space import Values

#: Names of the shipped and of the chosen preset in tables.
SHIPPED, TUNED = "shipped", "tuned"


@dataclass(frozen=True)
class Finalist:
    """A preset on the seeds of the choice."""

    score: Score  # over all scenes
    scenes: dict[str, Score]  # by scene
    damping: float  # least damping ratio of the contact

    def may_replace(self, shipped: Finalist) -> bool:
        """Whether it is better than the shipped preset on the mean, and clearly worse in no objective and no scene.

        Without a completed flight in a scene it has no figure there, and replaces nothing.
        """
        if any(each.failed == 1.0 for each in self.scenes.values()):
            return False
        near = all(allowed(self.scenes[name], each, SCENE_ROOM) for name, each in shipped.scenes.items())
        return near and allowed(self.score, shipped.score) and gain_over(self.score, shipped.score) < 0.0


def fly_finalists(
    plan: SearchPlan, trials: Trials, count: int, parts: Path, progress: SweepProgress
) -> dict[str, Finalist]:
    """Fly the best trials and the shipped preset on seeds of their own.

    Args:
        plan: The search.
        trials: Its trials.
        count: Seeds per scene.
        parts: Folder of the flights.
        progress: Progress of the flights.

    Returns:
        The shipped preset and every finalist, by name or number; empty when no trial qualifies.

    Raises:
        KeyboardInterrupt: On Ctrl-C; finished flights stay on disk.
    """
    dampings = {SHIPPED: contact_damping(plan.shipped)}
    presets: dict[str, Values] = {SHIPPED: {}}
    for number in ranked({number: each for number, (_, each) in trials.items()}, shipped_score(plan, trials)):
        if len(presets) > FINALISTS:
            break
        gains = trials[number][0]
        damping = contact_damping(plan.subject.having(gains).config)
        if damping >= LEAST_DAMPING * dampings[SHIPPED]:
            presets[str(number)], dampings[str(number)] = gains, damping
    if len(presets) == 1:
        return {}
    table = fly_presets(plan, presets, seeds(CHOICE_SEED, plan.seed, count), parts, progress)
    result = {}
    for name, damping in dampings.items():
        rows = table.filter(pl.col("variant") == name)
        by_scene = rows.partition_by(PARAM + "scene", maintain_order=True, as_dict=True)
        in_scenes = {str(scene): score(part.to_dicts()) for (scene,), part in by_scene.items()}
        result[name] = Finalist(score(rows.to_dicts()), in_scenes, damping)
    return result


def best_of(finalists: Mapping[str, Finalist]) -> int | None:
    """Number of the best finalist that may replace the shipped preset; None without one."""
    good = {name: each for name, each in finalists.items() if each.may_replace(finalists[SHIPPED])}
    best = min(good, key=lambda name: gain_over(good[name].score, finalists[SHIPPED].score), default=None)
    return None if best is None else int(best)


def shipped_score(plan: SearchPlan, trials: Trials) -> Score:
    """Score of the shipped gains, which are the first trial of every search."""
    gains = start_gains(plan)
    return next((each for found, each in trials.values() if found == gains), trials[min(trials)][1])


def fly_unseen(plan: SearchPlan, gains: Values, count: int, parts: Path, progress: SweepProgress) -> pl.DataFrame:
    """Flights of the shipped and of the chosen preset on the seeds of the report."""
    return fly_presets(plan, {SHIPPED: {}, TUNED: gains}, seeds(REPORT_SEED, plan.seed, count), parts, progress)


def fly_presets(
    plan: SearchPlan, presets: Mapping[str, Values], on_seeds: range, parts: Path, progress: SweepProgress
) -> pl.DataFrame:
    """Fly presets over all scenes, those of the search and the checks.

    Args:
        plan: The search.
        presets: Gains that differ from the shipped ones, by name of the preset.
        on_seeds: Seeds.
        parts: Folder of the flights.
        progress: Progress of the flights.

    Raises:
        KeyboardInterrupt: On Ctrl-C; finished flights stay on disk.
    """
    flown, runs = training() | checks(), []
    for name, gains in presets.items():
        runs += flights(flown, plan.subject.having(gains), name, on_seeds, plan.features)
    result = run_sweep(runs, parts, workers=plan.jobs, progress=progress)
    if result.interrupted:
        raise KeyboardInterrupt
    return result.table
