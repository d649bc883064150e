"""Shipped against tuned on unseen seeds: the same flights under both presets, difference by difference."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import polars as pl

from sim.evaluate.figures import FIGURES, MORE
from sim.sweep.parts import PARAM
from sim.sweep.statistics import median_interval, needed
from sim.tune.finalists import SHIPPED, TUNED
from sim.tune.objectives import OBJECTIVES, TASK


def paired(table: pl.DataFrame) -> pl.DataFrame:
    """One row per scene and seed with the figures of both presets, those of the tuned one suffixed ``.tuned``."""
    first, second = (table.filter(pl.col("variant") == name) for name in (SHIPPED, TUNED))
    return first.join(second, on=[PARAM + "scene", "seed"], suffix=f".{TUNED}", maintain_order="left")


def differences(table: pl.DataFrame) -> list[dict[str, Any]]:
    """Tuned minus shipped, flight by flight, over all scenes and for each.

    Returns:
        Per scene ("all" first) and objective of its task: n, medians of both, median of the differences with its
        interval, and a verdict: "better", "worse", "same" for an interval with zero inside, "too few" flights for an
        interval, or "none" without a pair of figures.
    """
    both = paired(table)
    by_scene = both.partition_by(PARAM + "scene", maintain_order=True, as_dict=True)
    result = []
    for scene, part in {"all": both, **{str(name): rows for (name,), rows in by_scene.items()}}.items():
        for each in OBJECTIVES:
            rows = part.filter(pl.col(PARAM + TASK).is_in(each.tasks))
            if rows.is_empty():
                continue
            before, after = (_sizes(rows, name) for name in (each.name, f"{each.name}.{TUNED}"))
            change, count = median_interval(after - before), int(np.isfinite(after - before).sum())
            result.append(
                {
                    "scene": scene,
                    "objective": each.name,
                    "n": count,
                    "shipped": median_interval(before)["median"],
                    "tuned": median_interval(after)["median"],
                    "difference": change,
                    "verdict": _verdict(change, count, FIGURES[each.name].better),
                }
            )
    return result


def _sizes(rows: pl.DataFrame, name: str) -> np.ndarray:
    """Size of a figure in every row; NaN where it is missing."""
    if name not in rows.columns:
        return np.full(rows.height, math.nan)
    return np.abs(rows[name].cast(pl.Float64).fill_null(math.nan).to_numpy())


def _verdict(change: dict[str, float], count: int, better: int) -> str:
    if count < needed():
        return "too few" if count else "none"
    less, more = change["high"] < 0.0, change["low"] > 0.0
    return "better" if (more if better == MORE else less) else "worse" if less or more else "same"


def objection(table: pl.DataFrame) -> str:
    """Why the tuned preset may not be recommended after the unseen flights, or "".

    It completes less often than the shipped one, or in some scene it has no figure at all.
    """
    both = paired(table)
    before, after = (int(both[name].cast(pl.Boolean).sum() or 0) for name in ("completed", f"completed.{TUNED}"))
    if after < before:
        return f"it completes {after} of {len(both)} unseen flights, the preset of the start {before}"
    for each in differences(table):
        if math.isnan(each["tuned"]):
            return f"in the scene {each['scene']} it has no figure for {each['objective']}: no flight completes"
    return ""
