"""The verdict of the results page: where the QP law is better, where it is worse, and where it does not matter."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from typing import Any, TypeVar

import numpy as np
import polars as pl
from scipy.stats import binomtest

from sim.evaluate.table import markdown
from sim.experiments.comparison import Comparison, compared_cells, comparisons
from sim.experiments.relevance import THRESHOLDS, Effect, threshold
from sim.experiments.spec import Experiment
from sim.experiments.wording import cell, exact, varying
from sim.sweep.paired import needed
from sim.sweep.statistics import CONFIDENCE

Flown = Sequence[tuple[Experiment, pl.DataFrame]]
T = TypeVar("T")
K = TypeVar("K")

#: Headings of the effects, QP law first.
HEADINGS = {
    Effect.FIRST: "QP better",
    Effect.SECOND: "analytic better",
    Effect.IRRELEVANT: "does not matter",
    Effect.OPEN: "undecided",
    Effect.FEW: "too few pairs",
}
#: Most rows of one table of the page; tables.md has all.
MOST_ROWS = 19


def capped(heads: Sequence[str], rows: Sequence[Sequence[str]], most: int = MOST_ROWS) -> str:
    """A Markdown table of the first rows, and how many more there are."""
    more = f"\n{len(rows) - most} more rows are in [tables.md](tables.md).\n" if len(rows) > most else ""
    return markdown(heads, rows[:most]) + more


def world_of(params: dict[str, Any]) -> str:
    """World of a cell; a dash if its experiment flies in one world only."""
    return str(params.get("world", "–"))


def verdict_section(flown: Flown) -> str:
    """Counts, then the figures in which each law is better, those that do not matter, and failed flights.

    Empty if no cell was flown under both laws.
    """
    if not any(list(compared_cells(experiment, table)) for experiment, table in flown):
        return ""
    found = [each for experiment, table in flown for each in comparisons(experiment, table)]
    best = [each for each in found if each.best]
    failures, completion = _failures(flown)
    text = f"{_headline(best)}{completion}\n{_counts(found)}\n{_method(best)}"
    for effect, title in ((Effect.FIRST, "The QP law is better"), (Effect.SECOND, "The analytic law is better")):
        text += f"\n### {title}\n\n{_better([each for each in best if each.effect == effect], best)}"
    text += "\n### It does not matter, or is not decided\n\n" + _rest(best)
    return text + "\n### Flights that did not end as planned\n\n" + failures


def _headline(best: Sequence[Comparison]) -> str:
    """One sentence per world: how many comparisons have which outcome."""
    text = ""
    for world in dict.fromkeys(world_of(each.params) for each in best):
        own = [each for each in best if world_of(each.params) == world]
        count = Counter(each.effect for each in own)
        enough = len(own) - count[Effect.FEW]
        if not enough:
            text += f"- {_in(world)}: no comparison of {len(own)} has {needed()} pairs.\n"
            continue
        qp, analytic = (_names([each for each in own if each.effect == side]) for side in (Effect.FIRST, Effect.SECOND))
        text += (
            f"- {_in(world)}: of {enough} comparisons the QP law is better in {count[Effect.FIRST]}{qp}, the analytic "
            f"law in {count[Effect.SECOND]}{analytic}; {count[Effect.IRRELEVANT]} do not matter, "
            f"{count[Effect.OPEN]} are undecided.\n"
        )
    return text


def _method(best: Sequence[Comparison]) -> str:
    """How a comparison is made and what its outcomes mean, with the thresholds of the figures compared."""
    units = {each.column.unit for each in best}
    least = "; ".join(
        f"{each.least:g} {each.unit}: {each.reason}" for each in THRESHOLDS if each.unit in units and not each.metrics
    )
    enough = sum(each.effect != Effect.FEW for each in best)
    return (
        "A comparison is one figure of merit in one cell: analytic law minus QP law, seed by seed, over the flights "
        "that both ended as planned, against the allocator with which the analytic law did best there (picked "
        f"afterwards, in its favour). *Better* takes {needed()} pairs, an exact {100.0 * CONFIDENCE:g} % interval of "
        "the median without zero (order statistics, the inverse of the sign test), and a median of at least a "
        f"practical threshold ({least}). A smaller difference *does not matter*, however certain it is. *Undecided*: "
        "the interval holds zero and differences that would matter. If the laws were equal, chance would leave zero "
        f"outside of up to {(1.0 - CONFIDENCE) * enough:.0f} of the {enough} intervals.\n"
    )


def _in(world: str) -> str:
    return "Experiments without a level of the world" if world == "–" else f"World *{world}*"


def _names(found: Sequence[Comparison]) -> str:
    names = ", ".join(f"{name} {n}" for name, n in Counter(each.experiment.name for each in found).items())
    return f" ({names})" if names else ""


def _counts(found: Sequence[Comparison]) -> str:
    """A row per experiment and world."""
    rows = []
    for name, world in dict.fromkeys((each.experiment.name, world_of(each.params)) for each in found):
        own = [each for each in found if (each.experiment.name, world_of(each.params)) == (name, world)]
        count = Counter(each.effect for each in own if each.best)
        each_one = []
        for allocator in dict.fromkeys(each.allocator for each in own):
            against = Counter(each.effect for each in own if each.allocator == allocator)
            each_one.append(f"{allocator} {against[Effect.FIRST]} : {against[Effect.SECOND]}")
        rows.append([name, world, *(str(count[effect]) for effect in HEADINGS), ", ".join(each_one)])
    return capped(("experiment", "world", *HEADINGS.values(), "QP : analytic better, by allocator"), rows, 30)


def _better(won: Sequence[Comparison], best: Sequence[Comparison]) -> str:
    """A row per experiment, world and figure of merit: in how many cells, and the cell that differs most."""
    if not won:
        return "In no comparison with enough pairs.\n"
    groups = grouped(won, lambda each: (each.experiment.name, world_of(each.params), each.variant, each.column.label))
    rows = []
    for (name, world, variant, label), own in groups.items():
        same = [each for each in best if (each.experiment.name, world_of(each.params)) == (name, world)]
        same = [each for each in same if (each.variant, each.column.label) == (variant, label)]
        most = max(own, key=lambda each: abs(each.found["median"]) * each.column.scale / threshold(each.column))
        places = varying([each.params for each in same])
        place = cell(most.experiment, places[same.index(most)])
        words = [part for part in (variant if variant != "standard" else "", place) if part]
        figure = f"{exact(most.found, most.column)} {most.column.unit}".rstrip()
        cells = f"{len(own)} of {len(same)}"
        rows.append([name, world, label, cells, figure, ", ".join(words), str(most.found["pairs"]), most.allocator])
    heads = (
        "experiment",
        "world",
        "figure of merit",
        "cells",
        "most: analytic minus QP",
        "there",
        "pairs",
        "allocator",
    )
    return capped(heads, rows)


def _rest(best: Sequence[Comparison]) -> str:
    """A row per experiment: figures that do not matter, and undecided ones, with the numbers of cells."""
    rows = []
    for name, own in grouped(best, lambda each: each.experiment.name).items():
        lists = []
        for effect in (Effect.IRRELEVANT, Effect.OPEN):
            count = Counter(each.column.label for each in own if each.effect == effect)
            total = Counter(each.column.label for each in own)
            lists.append("; ".join(f"{label} ({n} of {total[label]})" for label, n in count.items()) or "–")
        if set(lists) != {"–"}:
            rows.append([name, *lists])
    return capped(("experiment", "does not matter (cells)", "undecided (cells)"), rows)


def _failures(flown: Flown) -> tuple[str, str]:
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


def grouped(items: Sequence[T], key: Callable[[T], K]) -> dict[K, list[T]]:
    """Items by key, in their order."""
    groups: dict[K, list[T]] = {}
    for item in items:
        groups.setdefault(key(item), []).append(item)
    return groups
