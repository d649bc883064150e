"""Flights that ended as planned: counts of both laws, and the exact McNemar test of their pairs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import polars as pl
from scipy.stats import binomtest

from sim.experiments.comparison import compared_cells
from sim.experiments.relevance import Effect
from sim.experiments.sections import HEADINGS, Flown, capped, grouped, world_of
from sim.sweep.statistics import CONFIDENCE, needed


def completion_section(flown: Flown) -> tuple[str, str]:
    """Flights that ended as planned, where some did not, with the exact McNemar test against the best allocator.

    Returns:
        The table, and one line on where a law is better.
    """
    rows, fine, better = [], [], {Effect.FIRST: [], Effect.SECOND: []}
    for experiment, table in flown:
        cells = list(compared_cells(experiment, table))
        before = len(rows)
        for (world, variant, kind), own in grouped(
            cells, lambda each: (world_of(each[1]), each[0], str(each[1].get("kind", "")))
        ).items():
            names = dict.fromkeys(name for *_, parts in own for name in parts)
            pairs = {name: _pairs([(qp, parts[name]) for *_, qp, parts in own if name in parts]) for name in names}
            if all(each.all() for each in pairs.values()):
                continue
            best = max(names, key=lambda name: pairs[name][:, 1].mean())
            outcome, words = _mcnemar(pairs[best])
            done = [f"{name} {done[:, 1].sum()} of {len(done)}" for name, done in pairs.items()]
            qp = f"{pairs[best][:, 0].sum()} of {len(pairs[best])}"
            what = ", ".join(part for part in (variant if variant != "standard" else "", kind) if part)
            against = f"{words} ({best})" if len(names) > 1 else words
            rows.append([experiment.name, world, what or "–", qp, ", ".join(done), against])
            if outcome in better:
                where = ", ".join(part for part in (what, world if world != "–" else "") if part)
                better[outcome].append(f"{experiment.name} ({where})" if where else experiment.name)
        if cells and len(rows) == before:
            fine.append(experiment.name)
    heads = (
        "experiment",
        "world",
        "flights",
        "done, QP",
        "done, analytic law by allocator",
        "against the best of them",
    )
    text = capped(heads, rows) if rows else ""
    if rows:
        text += (
            "\nExact McNemar test over the pairs of which one flight failed; flights of one seed in several cells are "
            "several pairs. "
        )
    if fine:
        text += f"Every flight of both laws ended as planned in: {', '.join(fine)}."
    qp, analytic = (", ".join(better[side]) or "nowhere" for side in (Effect.FIRST, Effect.SECOND))
    line = f"- Flights that end as planned: more of the QP law in: {qp}; more of the analytic law in: {analytic}.\n"
    return text + "\n", line


def _pairs(parts: Sequence[tuple[pl.DataFrame, pl.DataFrame]]) -> np.ndarray:
    """Whether each pair ended as planned, QP law first, (n, 2)."""
    joined = [qp.join(other, on="seed", suffix=".other") for qp, other in parts]
    return np.vstack([each.select("completed", "completed.other").to_numpy() for each in joined])


def _mcnemar(done: np.ndarray) -> tuple[Effect, str]:
    """Outcome of the exact McNemar test, with words; `done` is (n, 2), QP law first."""
    qp, analytic = int((done[:, 0] & ~done[:, 1]).sum()), int((~done[:, 0] & done[:, 1]).sum())
    if len(done) < needed():
        return Effect.FEW, HEADINGS[Effect.FEW]
    if not qp + analytic:
        return Effect.IRRELEVANT, "equal"
    p = float(binomtest(qp, qp + analytic).pvalue)
    outcome = Effect.OPEN if p >= 1.0 - CONFIDENCE else Effect.FIRST if qp > analytic else Effect.SECOND
    return outcome, f"{HEADINGS[outcome]}: {qp} against {analytic} pairs, p = {p:.2g}"
