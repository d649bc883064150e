"""Shipped against tuned on unseen seeds: the same flights under both presets, difference by difference."""

from __future__ import annotations

from typing import Any

import numpy as np
import polars as pl

from sim.sweep.parts import PARAM
from sim.sweep.statistics import median_interval, needed
from sim.tune.finalists import SHIPPED, TUNED
from sim.tune.objectives import OBJECTIVES


def paired(table: pl.DataFrame) -> pl.DataFrame:
    """One row per scene and seed with the figures of both presets, those of the tuned one suffixed ``.tuned``."""
    first, second = (table.filter(pl.col("variant") == name) for name in (SHIPPED, TUNED))
    return first.join(second, on=[PARAM + "scene", "seed"], suffix=f".{TUNED}", maintain_order="left")


def differences(table: pl.DataFrame) -> list[dict[str, Any]]:
    """Tuned minus shipped, flight by flight, over all scenes and for each.

    Returns:
        Per scene ("all" first) and objective: n, medians of both, median of the differences with its interval, and
        a verdict: "better", "worse", "same" for an interval with zero inside, or "too few" flights for an interval.
    """
    both = paired(table)
    by_scene = both.partition_by(PARAM + "scene", maintain_order=True, as_dict=True)
    result = []
    for scene, rows in {"all": both, **{str(name): rows for (name,), rows in by_scene.items()}}.items():
        for each in OBJECTIVES:
            before, after = (rows[name].cast(pl.Float64).to_numpy() for name in (each.name, f"{each.name}.{TUNED}"))
            change, count = median_interval(after - before), int(np.isfinite(after - before).sum())
            verdict = "better" if change["high"] < 0.0 else "worse" if change["low"] > 0.0 else "same"
            result.append(
                {
                    "scene": scene,
                    "objective": each.name,
                    "n": count,
                    "shipped": median_interval(before)["median"],
                    "tuned": median_interval(after)["median"],
                    "difference": change,
                    "verdict": verdict if count >= needed() else "too few",
                }
            )
    return result
