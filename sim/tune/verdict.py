"""Shipped against tuned on seeds that the search never saw: the same flights under both, difference by difference."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from sim.sweep.engine import SweepProgress
from sim.sweep.parts import PARAM
from sim.sweep.statistics import median_interval
from sim.tune.finalists import SHIPPED, fly_presets
from sim.tune.flights import REPORT_SEED, seeds
from sim.tune.objectives import OBJECTIVES
from sim.tune.search import SearchPlan

#: Name under which the chosen preset flies.
TUNED = "tuned"


def unseen(plan: SearchPlan, gains: dict[str, float], count: int, parts: Path, progress: SweepProgress) -> pl.DataFrame:
    """Flights of the shipped and of the chosen preset on the seeds of the report."""
    return fly_presets(plan, {SHIPPED: {}, TUNED: gains}, seeds(REPORT_SEED, plan.seed, count), parts, progress)


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
