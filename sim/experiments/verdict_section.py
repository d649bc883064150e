"""The verdict of the results page: where the QP law is better, where it is worse, and where it does not matter."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from sim.evaluate.figures import MATTERS
from sim.experiments.comparison import Comparison, compared_cells, comparisons
from sim.experiments.completion_section import completion_section
from sim.experiments.relevance import Effect, threshold
from sim.experiments.sections import HEADINGS, Flown, capped, grouped, world_of
from sim.experiments.wording import cell, exact, varying
from sim.sweep.statistics import CONFIDENCE, needed


def verdict_section(flown: Flown) -> str:
    """Counts, then the figures in which each law is better, those that do not matter, and failed flights.

    Empty if no cell was flown under both laws.
    """
    if not any(list(compared_cells(experiment, table)) for experiment, table in flown):
        return ""
    found = [each for experiment, table in flown for each in comparisons(experiment, table)]
    best = [each for each in found if each.best]
    failures, completion = completion_section(flown)
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
    """Method of a comparison and meaning of its outcomes, with the thresholds of the figures compared."""
    units = {each.column.unit for each in best}
    least = "; ".join(f"{amount:g} {unit}: {reason}" for unit, (amount, reason) in MATTERS.items() if unit in units)
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
