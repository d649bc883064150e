"""The page of tables behind the results page, as Markdown: criteria, cells, differences, failures, figures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import polars as pl

from sim.evaluate.table import markdown
from sim.experiments.comparison import compared_cells
from sim.experiments.criteria_section import criteria_table
from sim.experiments.parts_section import parts_table
from sim.experiments.spec import Experiment
from sim.experiments.variants import VARIANTS
from sim.experiments.wording import cell, difference, entry, headings, interval, measured, value_of
from sim.flight.trace import law_name
from sim.sweep.paired import differences
from sim.sweep.statistics import cells, false_claims, needed, parameters, split

#: Top of the page.
_HEAD = """# Tables behind the results

Generated from data by `{command}`; do not edit. {lead} [results.md](results.md) is the summary,
[experiments.md](../experiments.md) describes the experiments.

*Met*: a bound marked *every* (flags, peaks, bounces) applies to each flight, one marked with a fraction to that
fraction of them, any other bound to the median of the cell; if not all flights are within the bound, the number within
it follows. A flight without the metric fails.
Values are medians over the flights of a cell, with their 95 % bootstrap interval in brackets; of fewer than {needed}
flights with their minimum and maximum, named so. Bars in figures are the same. *Done* counts the flights that ended as
planned, by the truth and by the pilot's claim; values come from those flights only. Differences are taken between
flights with the same seed that both ended as planned, with the exact interval of the median in brackets; **bold** means
that the interval excludes
zero. Fewer than {needed} pairs are too few for such an interval.

"""


@dataclass(frozen=True, kw_only=True)
class Section:
    """One flown experiment of the pages."""

    experiment: Experiment
    table: pl.DataFrame  # its rows
    figures: Mapping[str, tuple[str, Path]]  # caption and file of each; files are relative to the page


def tables_page(sections: Sequence[Section], lead: str, command: str, name: str) -> str:
    """Markdown text of the page; arguments as of `sim.experiments.page.results_page`."""
    text = _HEAD.format(command=command.format(name=name), lead=lead, needed=needed())
    text += "## Criteria of the QP law\n\n"
    text += criteria_table([(section.experiment, section.table) for section in sections])
    for section in sections:
        experiment, table = section.experiment, section.table
        text += f"\n## {experiment.title}\n\n{experiment.about}\n\n"
        text += f"**Published:** {experiment.published}\n\n"
        text += f"Command: `{command.format(name=experiment.name)}`\n\n"
        text += _table(experiment, table) + "\n" + _differences(experiment, table) + parts_table(experiment, table)
        text += _failures(experiment, table)
        for caption, file in section.figures.values():
            text += f"![{caption}]({file.as_posix()})\n\n*{caption}.*\n\n"
    return text


def _table(experiment: Experiment, table: pl.DataFrame) -> str:
    columns = measured(experiment, table)
    heads = [*experiment.params.values(), "variant", "law", "done", *headings(columns)]
    rows: dict[bool, list[list[str]]] = {False: [], True: []}
    for flown in cells(table, {column.metric for column in columns if column.of_all}):
        row = [entry(flown["params"].get(name, "")) for name in experiment.params]
        row += [flown["variant"], law_name(flown["law"]), f"{flown['completed']} of {flown['n']}"]
        values = ((value_of(flown["metrics"], column, flown["params"]), column) for column in columns)
        row += [interval(value, column, flown["counts"].get(column.metric, 0)) for value, column in values]
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
    for variant, params, qp, parts in compared_cells(experiment, table, tuple(VARIANTS)):
        for allocator, part in parts.items():
            found = differences(qp, part, [column.metric for column in columns])
            row = [entry(params.get(name, "")) for name in experiment.params]
            row += [variant, allocator, f"{found['n']} of {found['flown']}", " and ".join(map(str, found["failed"]))]
            values = ((value_of(found["differences"], column, params), column) for column in columns)
            rows.append(row + [difference(*each) for each in values])
    heads = [
        *experiment.params.values(),
        "variant",
        "allocator",
        "pairs",
        "failed, QP and analytic",
        *headings(columns),
    ]
    return f"Analytic law minus QP law:\n\n{markdown(heads, rows)}\n" if rows else ""


def _failures(experiment: Experiment, table: pl.DataFrame) -> str:
    failed = table.filter(~pl.col("completed"))
    if not failed.height:
        return ""
    count = false_claims(table)
    lines = [f"Flights that did not end as planned, {count} of them claimed by the pilot:", ""]
    for key, rows in split(failed, ("law", "variant", "reason")):
        seeds = ", ".join(map(str, sorted(rows["seed"])))
        where = cell(experiment, parameters(key))
        lines.append(f"- {law_name(key['law'])}, {key['variant']}, {where}, seeds {seeds}: {key['reason']}")
    return "\n".join(lines) + "\n\n"
