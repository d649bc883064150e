"""Benefit of each part of the controller: variants against the variant that has the part, seed by seed."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from typing import Any

from sim.evaluate.table import markdown
from sim.experiments.impedance_section import DIRECT
from sim.experiments.relevance import Effect, effect, threshold
from sim.experiments.sections import Flown, capped, grouped, world_of
from sim.experiments.spec import Column, Experiment
from sim.experiments.variants import REFERENCES, VARIANTS
from sim.experiments.wording import cell, difference, exact, headings, measured, value_of, varying
from sim.flight.trace import law_name
from sim.sweep.paired import variant_differences


def parts_section(flown: Flown) -> str:
    """A row per variant, experiment, world and law: flights done, counts of outcomes, and the largest effect.

    Allocators belong to the verdict; direct force control and rivals have sections of their own.
    """
    rows, explained = [], set()
    entries = _entries(flown, _is_part)
    groups = grouped(
        entries, lambda each: (each[2]["variant"], each[0].name, world_of(each[2]["params"]), each[2]["law"])
    )
    for (variant, name, world, law), own in groups.items():
        experiment, columns, _ = own[0]
        found = [
            (effect(value, column), value, column, place)
            for (*_, entry), place in zip(own, varying([entry["params"] for *_, entry in own]), strict=True)
            for column in columns
            if column.better and (value := value_of(entry["differences"], column, entry["params"])) is not None
        ]
        count = Counter(outcome for outcome, *_ in found)
        flights = sum(entry["flown"] for *_, entry in own)
        reference, failed = (sum(entry["failed"][index] for *_, entry in own) for index in (0, 1))
        words = f"*{variant}*" + (f": {VARIANTS[variant].words}" if variant not in explained else "")
        explained.add(variant)
        done = f"{flights - failed} and {flights - reference} of {flights}"
        numbers = (
            str(count[each]) for each in (Effect.FIRST, Effect.SECOND, Effect.IRRELEVANT, Effect.OPEN, Effect.FEW)
        )
        rows.append([words, name, world, law_name(law), done, *numbers, _largest(experiment, found)])
    heads = ("variant", "experiment", "world", "law", "done, variant and reference", "reference better",
             "variant better", "does not matter", "undecided", "too few pairs",
             "largest effect: variant minus reference")  # fmt: skip
    return capped(heads, rows) if rows else ""


def rivals_section(flown: Flown) -> str:
    """Other formulations in place of the QP: counts of outcomes, then every figure that differs by enough."""
    text, rows = "", []
    for rival, own in grouped(_entries(flown, lambda name: bool(VARIANTS[name].controller)), _variant).items():
        count = Counter[Effect]()
        for experiment, columns, entry in own:
            for column in columns:
                value = value_of(entry["differences"], column, entry["params"]) if column.better else None
                if value is None:
                    continue
                outcome = effect(value, column)
                count[outcome] += 1
                if outcome in (Effect.FIRST, Effect.SECOND):
                    side = "QP" if outcome is Effect.FIRST else f"*{rival}*"
                    figure, place = f"{exact(value, column)} {column.unit}".rstrip(), cell(experiment, entry["params"])
                    rows.append([side, column.label, place, figure, str(entry["n"])])
        decided = sum(count.values()) - count[Effect.FEW]
        text += (
            f"- *{rival}*, {VARIANTS[rival].words}: of {decided} comparisons it is better in {count[Effect.SECOND]}, "
            f"the QP in {count[Effect.FIRST]}; {count[Effect.IRRELEVANT]} do not matter, {count[Effect.OPEN]} are "
            "undecided.\n"
        )
    heads = ("better", "figure of merit", "cell", "rival minus QP", "pairs")
    return text + ("\n" + capped(heads, rows) if rows else "")


def _variant(entry: tuple[Experiment, Sequence[Column], dict[str, Any]]) -> str:
    return entry[2]["variant"]


def _is_part(name: str) -> bool:
    return "allocator" not in VARIANTS[name].switches and name != DIRECT and not VARIANTS[name].controller


def _entries(flown: Flown, chosen: Callable[[str], bool]) -> list[tuple[Experiment, Sequence[Column], dict[str, Any]]]:
    """Differences of the chosen variants, in the order of the variants."""
    entries = [
        (experiment, columns, entry)
        for experiment, table in flown
        for columns in (measured(experiment, table),)
        for entry in _differences(experiment, table, columns)
        if chosen(entry["variant"])
    ]
    return sorted(entries, key=lambda each: list(REFERENCES).index(_variant(each)))


def _largest(experiment: Experiment, found: Sequence[tuple[Effect, dict[str, float], Column, dict[str, Any]]]) -> str:
    """The effect that exceeds its threshold most, in words."""
    sure = [each for each in found if each[0] in (Effect.FIRST, Effect.SECOND)]
    if not sure:
        return "–"
    _, value, column, place = max(sure, key=lambda each: abs(each[1]["median"]) * each[2].scale / threshold(each[2]))
    where = cell(experiment, place)
    return f"{column.label} {exact(value, column)} {column.unit}".rstrip() + (f", {where}" if where else "")


def parts_table(experiment: Experiment, table: Any) -> str:
    """Every difference of variants of an experiment; empty without variants."""
    columns = measured(experiment, table)
    found = _differences(experiment, table, columns)
    found.sort(key=lambda entry: list(REFERENCES).index(entry["variant"]))
    rows = []
    for entry, place in zip(found, varying([entry["params"] for entry in found]), strict=True):
        reference, variant = entry["failed"]
        flown = entry["flown"]
        done = f"{flown - variant} and {flown - reference} of {flown}"
        row = [
            entry["variant"],
            entry["against"],
            law_name(entry["law"]),
            cell(experiment, place),
            done,
            str(entry["n"]),
        ]
        values = ((value_of(entry["differences"], column, entry["params"]), column) for column in columns)
        rows.append(row + [difference(*each) for each in values])
    heads = ("variant", "reference", "law", "cell", "done", "pairs", *headings(columns))
    return f"Variant minus reference, the same law:\n\n{markdown(heads, rows)}\n" if rows else ""


def _differences(experiment: Experiment, table: Any, columns: Sequence[Column]) -> list[dict[str, Any]]:
    found = variant_differences(table, REFERENCES, [column.metric for column in columns])
    return [entry for entry in found if not experiment.is_folded(entry["params"])]
