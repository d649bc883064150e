"""The results page as Markdown; all numbers come from the tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl

from sim.evaluate.table import law_name, markdown
from sim.experiments.balance import balance
from sim.experiments.clipping import clipping
from sim.experiments.spec import Experiment
from sim.experiments.variants import VARIANTS
from sim.experiments.verdict import Verdict, verdicts
from sim.experiments.wording import cell, difference, entry, headings, interval, measured, value_of
from sim.experiments.worth import worth
from sim.sweep.paired import needed, paired_differences
from sim.sweep.parts import PARAM
from sim.sweep.statistics import cells, parameters, split

#: Top of the page.
_HEAD = """# Results of the experiments

Generated from data by `{command}`; do not edit. {lead}
*Met*: a bound marked *every* (flags, peaks, bounces) applies to each flight, one marked with a share to that share of
them, any other bound to the median of the cell; if not all flights are within the bound, the number within it follows.
A flight without the metric fails.
Values are medians over the flights of a cell, with their 95 % bootstrap interval in brackets. *Done* counts the flights
that ended as planned; values come from those flights only. Differences are analytic law minus QP law with the same
seeds, over the flights that both laws ended as planned, with the exact interval of the median in brackets; **bold**
means that the interval excludes zero. Fewer than {needed} pairs are too few for such an interval.
[experiments.md](../experiments.md) describes the experiments.

"""


@dataclass(frozen=True, kw_only=True)
class Section:
    """One flown experiment of the page."""

    experiment: Experiment
    table: pl.DataFrame  # its rows
    figures: Mapping[str, tuple[str, Path]]  # caption and file of each; files are relative to the page


def results_page(sections: Sequence[Section], lead: str, command: str, name: str) -> str:
    """Markdown text of the page.

    Args:
        sections: The flown experiments.
        lead: A sentence on what was flown.
        command: Command that repeats one experiment, with ``{name}`` in the place of its name.
        name: What was flown: an experiment, or "all".
    """
    text = _HEAD.format(command=command.format(name=name), lead=lead, needed=needed())
    text += "## Criteria of the QP law\n\n" + _criteria(sections)
    tables = [(section.experiment, section.table) for section in sections]
    text += "\n## Comparison of the two laws\n\n" + balance(tables)
    for _, table in tables:
        near = clipping(table) if "clipped" in table["variant"] and PARAM + "push_n" in table.columns else ""
        text += f"\n### Limits in the QP against clipping\n\n{near}" if near else ""
    text += "\n## Effect of each part\n\n" + worth(tables)
    for section in sections:
        experiment, table = section.experiment, section.table
        text += f"\n## {experiment.title}\n\n{experiment.about}\n\n"
        text += f"**Published:** {experiment.published}\n\n"
        text += f"Command: `{command.format(name=experiment.name)}`\n\n"
        text += _table(experiment, table) + "\n" + _differences(experiment, table) + _failures(experiment, table)
        for caption, file in section.figures.values():
            text += f"![{caption}]({file.as_posix()})\n\n*{caption}.*\n\n"
    return text


def _criteria(sections: Sequence[Section]) -> str:
    heads = ("experiment", "metric", "cell", "bound", "median", "worst flight", "flights within", "met")
    flown = ((section.experiment, section.table) for section in sections)
    return markdown(heads, [_verdict(each, verdict) for each, table in flown for verdict in verdicts(each, table)])


def _verdict(experiment: Experiment, verdict: Verdict) -> list[str]:
    criterion = verdict.criterion
    unit = f" {criterion.unit}" if criterion.unit else ""
    sign = (">=" if criterion.least else "<=") + (" every" if criterion.every and criterion.share == 1.0 else "")
    share = f" in {100.0 * criterion.share:.0f} %" if criterion.every and criterion.share < 1.0 else ""
    where = cell(experiment, verdict.place) or "all"
    where += f", {criterion.variant}" if criterion.variant != "standard" else ""
    values = (f"{value:.3g}{unit}" if np.isfinite(value) else "–" for value in (verdict.median, verdict.worst))
    met = "**no**" if verdict.words == "no" else verdict.words
    bound, within = f"{sign} {verdict.bound:.4g}{unit}{share}", f"{verdict.within} of {verdict.n}"
    return [experiment.name, criterion.text, where, bound, *values, within, met]


def _table(experiment: Experiment, table: pl.DataFrame) -> str:
    columns = measured(experiment, table)
    heads = [*experiment.params.values(), "variant", "law", "done", *headings(columns)]
    rows: dict[bool, list[list[str]]] = {False: [], True: []}
    for flown in cells(table, {column.metric for column in columns if column.of_all}):
        row = [entry(flown["params"].get(name, "")) for name in experiment.params]
        row += [flown["variant"], law_name(flown["law"]), f"{flown['completed']} of {flown['n']}"]
        row += [interval(value_of(flown["metrics"], column, flown["params"]), column) for column in columns]
        rows[experiment.is_folded(flown["params"])].append(row)
    text = markdown(heads, rows[False])
    if rows[True]:
        text += f"\n<details><summary>{len(rows[True])} more cells; the figure shows them</summary>\n\n"
        text += markdown(heads, rows[True]) + "\n</details>\n"
    used = [name for name in VARIANTS if name in table["variant"].unique().to_list()]
    notes = "; ".join(f"*{name}*: {VARIANTS[name].words}" for name in used)
    return text + f"\nVariants: {notes}.\n"


def _differences(experiment: Experiment, table: pl.DataFrame) -> str:
    columns = measured(experiment, table)
    rows = []
    for flown in paired_differences(table, [column.metric for column in columns]):
        params = flown["params"]
        if experiment.is_folded(params):
            continue
        row = [entry(params.get(name, "")) for name in experiment.params]
        row += [flown["variant"], f"{flown['n']} of {flown['flown']}", " and ".join(map(str, flown["failed"]))]
        rows.append(row + [difference(value_of(flown["differences"], column, params), column) for column in columns])
    heads = [*experiment.params.values(), "variant", "pairs", "failed, QP and analytic", *headings(columns)]
    return f"Analytic law minus QP law:\n\n{markdown(heads, rows)}\n" if rows else ""


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
