"""The results page: every number comes from the tables, none is typed."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from sim.experiments.balanced import account
from sim.experiments.base import Experiment
from sim.experiments.clipping import clipping
from sim.experiments.variants import VARIANTS
from sim.experiments.verdict import Verdict, telling, verdicts
from sim.experiments.wording import cell, entry, figure, folded, headed, markdown, of, shown
from sim.experiments.worth import difference, worth
from sim.figures.style import law_name
from sim.sweep.paired import needed, paired_differences
from sim.sweep.parts import PARAM
from sim.sweep.statistics import cells, parameters, split

#: Top of the page.
_HEAD = """# Results of the experiments

Generated from data by `{command}`; do not edit. {lead}
*Met*: flags, peaks and bounces (marked *every*) must hold in every flight, other figures by the median of the cell,
then with the count of flights where not all hold; a flight without the figure makes it a no.
Medians over the flights of a cell, in brackets their 95 % bootstrap interval; *done* counts the flights that ended as
planned, and only those have figures. Differences are analytic law minus QP law, flown with the same seeds, over the
flights that both ended as planned, in brackets the exact interval of the median; **bold** where it excludes zero. Of
fewer than {needed} pairs there is no such interval: they are too few to tell. What each experiment flies and what the
paper reports is in [experiments.md](../experiments.md).

"""


def results_page(
    flown: Sequence[tuple[Experiment, pl.DataFrame, dict[str, tuple[str, Path]]]], lead: str, command: str, name: str
) -> str:
    """Markdown text of the page.

    Args:
        flown: Experiments with their tables and the caption and file of their figures, files relative to the page.
        lead: A sentence on what was flown.
        command: The command that flies one experiment alike, with ``{name}`` where its name goes.
        name: What was flown.
    """
    text = _HEAD.format(command=command.format(name=name), lead=lead, needed=needed())
    text += "## What the QP law is held to\n\n" + _summary(flown)
    tables = [(experiment, table) for experiment, table, _ in flown]
    text += "\n## Where the QP helps, and where it does not\n\n" + account(tables)
    for _, table in tables:
        near = clipping(table) if "clipped" in table["variant"] and PARAM + "push_n" in table.columns else ""
        text += f"\n### Where clipping wins and loses\n\n{near}" if near else ""
    text += "\n## What each part is worth\n\n" + worth(tables)
    for experiment, table, figures in flown:
        text += f"\n## {experiment.title}\n\n{experiment.about}\n\n"
        text += f"**Published:** {experiment.paper}\n\n"
        text += f"To redo it: `{command.format(name=experiment.name)}`\n\n"
        text += _table(experiment, table) + "\n" + _differences(experiment, table)
        text += _failures(experiment, table)
        for caption, file in figures.values():
            text += f"![{caption}]({file.as_posix()})\n\n*{caption}.*\n\n"
    return text


def _summary(flown: Sequence[tuple[Experiment, pl.DataFrame, dict[str, tuple[str, Path]]]]) -> str:
    heads = ("experiment", "figure", "cell", "bound", "median", "worst flight", "flights within", "met")
    lines = ["| " + " | ".join(heads) + " |", "|" + "---|" * len(heads)]
    for experiment, table, _ in flown:
        listed = verdicts(experiment, table)
        lines += [_verdict_line(experiment, verdict, telling(listed, verdict)) for verdict in listed]
    return "\n".join(lines) + "\n"


def _verdict_line(experiment: Experiment, verdict: Verdict, place: dict[str, Any]) -> str:
    criterion = verdict.criterion
    sign, unit = (">=" if criterion.least else "<="), f" {criterion.unit}" if criterion.unit else ""
    sign += " every" if criterion.every else ""
    where = cell(experiment, place) or "all"
    if criterion.variant != "standard":
        where += f", {criterion.variant}"
    return (
        f"| {experiment.name} | {criterion.text} | {where} | {sign} {verdict.bound:.4g}{unit} | "
        f"{_number(verdict.median, unit)} | {_number(verdict.worst, unit)} | {verdict.held} of {verdict.n} | "
        f"{'**no**' if verdict.words == 'no' else verdict.words} |"
    )


def _number(value: float, unit: str) -> str:
    return f"{value:.3g}{unit}" if np.isfinite(value) else "–"


def _table(experiment: Experiment, table: pl.DataFrame) -> str:
    columns = shown(experiment, table)
    heads = [*experiment.params.values(), "variant", "law", "done", *headed(columns)]
    rows: dict[bool, list[list[str]]] = {False: [], True: []}
    for flown in cells(table, {column.metric for column in columns if column.of_all}):
        row = [entry(flown["params"].get(name, "")) for name in experiment.params]
        row += [flown["variant"], law_name(flown["law"]), f"{flown['completed']} of {flown['n']}"]
        row += [figure(of(flown["metrics"], column, flown["params"]), column) for column in columns]
        rows[folded(experiment, flown["params"])].append(row)
    text = markdown(heads, rows[False])
    if rows[True]:
        text += f"\n<details><summary>{len(rows[True])} more cells, which the figure shows</summary>\n\n"
        text += markdown(heads, rows[True]) + "\n</details>\n"
    used = [name for name in VARIANTS if name in table["variant"].unique().to_list()]
    notes = "; ".join(f"*{name}*: {VARIANTS[name].words}" for name in used)
    return text + f"\nVariants: {notes}.\n"


def _differences(experiment: Experiment, table: pl.DataFrame) -> str:
    columns = shown(experiment, table)
    found = paired_differences(table, [column.metric for column in columns])
    found = [flown for flown in found if not folded(experiment, flown["params"])]
    if not found:
        return ""
    heads = [*experiment.params.values(), "variant", "pairs", "failed, QP and analytic", *headed(columns)]
    rows = []
    for flown in found:
        row = [entry(flown["params"].get(name, "")) for name in experiment.params]
        row += [flown["variant"], f"{flown['n']} of {flown['flown']}", " and ".join(map(str, flown["failed"]))]
        rows.append(row + [difference(of(flown["differences"], column, flown["params"]), column) for column in columns])
    return f"Analytic law minus QP law:\n\n{markdown(heads, rows)}\n"


def _failures(experiment: Experiment, table: pl.DataFrame) -> str:
    failed = table.filter(~pl.col("completed"))
    if not failed.height:
        return ""
    lines = ["Flights that did not end as planned:", ""]
    for key, rows in split(failed, ("law", "variant", "reason")):
        seeds = ", ".join(map(str, sorted(rows["seed"])))
        where = cell(experiment, parameters(key))
        lines.append(f"- {law_name(key['law'])}, {key['variant']}, {where}, seeds {seeds}: {key['reason']}")
    return "\n".join(lines) + "\n\n"
