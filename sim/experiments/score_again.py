"""Flights of a stored table scored by the truth, as far as their stored figures suffice.

``python -m sim.experiments.score_again docs/experiments/all.parquet`` prints the section of docs/experiments.md.

A table from before `sim.evaluate.truth` has the pilot's claim as ``completed``, and no place of a stroke. Its figures
still decide many flights: without data on a condition, only the others count.
"""

from __future__ import annotations

import math
import sys
from collections import Counter
from pathlib import Path
from typing import Any

import polars as pl

from sim.evaluate.table import markdown
from sim.evaluate.truth import CONTACT, LENGTH_M, PLACE_M, ROUGH_CONTACT, SLID
from sim.experiments import ALL
from sim.experiments.design import Choice, designs
from sim.flight.jobs import PaintJob
from sim.sweep.design import Run
from sim.sweep.statistics import parameters
from sim.world.board import BoardGeometry
from sim.world.worlds import HARSH, world_name

#: Outcomes of a claimed flight.
HOLDS, FAILS, OPEN = "no fault found", "fails", "not decided"


def score(row: dict[str, Any], run: Run) -> tuple[str, str]:
    """Outcome of a claimed flight by its stored figures, and the failed or unknown criterion."""
    figures = {name: value for name, value in row.items() if isinstance(value, float) and math.isfinite(value)}
    return _paint(figures, run) if isinstance(run.plan.job, PaintJob) else _press(figures, run)


def _paint(figures: dict[str, float], run: Run) -> tuple[str, str]:
    scene = run.plan.scene
    paint, board = scene.paint, BoardGeometry(scene)
    rough = scene.wind.gust_n_rms > 0.0 or world_name(scene.errors) == HARSH
    contact = ROUGH_CONTACT if rough else CONTACT
    if figures["contact_share"] < contact:
        return FAILS, "contact"
    if abs(figures["stroke_m"] - paint.stroke_m) > LENGTH_M:
        return FAILS, "length of the shortest stroke"
    # Strokes at their places touch: only the outer edges of the pattern and the ends of its strokes stay bare.
    across = (board.stroke_place(board.strokes) - board.stroke_place(1)) + paint.brush_width_m
    least = 1.0 - 2.0 * PLACE_M / across - LENGTH_M / paint.stroke_m - (1.0 - contact)
    if figures["coverage"] < least:
        return FAILS, "coverage"
    # The place error of stroke k is the sum of the mean height errors of strokes 1 to k, each relative to the one
    # before; their sum is at most sqrt(n) times the root of the sum of their squares.
    if board.strokes * figures["height_error_rms_m"] <= PLACE_M:
        return HOLDS, ""
    return OPEN, "place of a stroke"


def _press(figures: dict[str, float], run: Run) -> tuple[str, str]:
    if figures.get("touched", figures.get("hold_touched", 1.0)) < 1.0:
        return FAILS, "touch"
    if figures.get("detached", 1.0) < 1.0:
        return FAILS, "retreat"
    if run.plan.job.plan["paint"] > 0.0 and "speed_m_s" in figures:
        if figures["speed_m_s"] < SLID * run.plan.scene.paint.speed_m_s:
            return FAILS, "way of the slide"
    return HOLDS, ""


def scored(table: pl.DataFrame, runs: list[Run]) -> pl.DataFrame:
    """Experiment, law, variant, seed, outcome, and why, of every flight that the table holds as completed."""
    by_key = {_key(run.experiment, run.law, run.variant, run.seed, run.params): run for run in runs}
    rows = []
    for row in table.filter(pl.col("completed")).to_dicts():
        names = ("experiment", "law", "variant", "seed")
        run = by_key[_key(row["experiment"], row["law"], row["variant"], row["seed"], parameters(row))]
        outcome, why = score(row, run)
        rows.append({name: row[name] for name in names} | {"outcome": outcome, "why": why})
    return pl.DataFrame(rows)


def _key(experiment: str, law: str, variant: str, seed: int, params: dict[str, Any]) -> tuple[Any, ...]:
    return experiment, law, variant, seed, tuple(sorted((name, str(value)) for name, value in params.items()))


def section(found: pl.DataFrame) -> str:
    """Markdown table by experiment and law."""
    rows = []
    for (experiment, law), part in found.group_by(["experiment", "law"], maintain_order=True):
        count = Counter(part["outcome"])
        failed = Counter(part.filter(pl.col("outcome") == FAILS).select("why", "variant").rows())
        words = "; ".join(f"{why} ({variant}: {n})" for (why, variant), n in failed.items())
        rows.append(
            [str(experiment), str(law), str(part.height), *(str(count[o]) for o in (HOLDS, FAILS, OPEN)), words]
        )
    return markdown(("experiment", "law", "claimed", HOLDS, FAILS, OPEN, "failed criteria"), rows)


if __name__ == "__main__":
    print(section(scored(pl.read_parquet(Path(sys.argv[1])), designs(ALL, Choice()))), end="")
