"""The results page: every number comes from the tables, none is typed."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from sim.experiments.balance import Paired, balance
from sim.experiments.base import Column, Experiment
from sim.experiments.variants import VARIANTS
from sim.experiments.verdict import Verdict, telling, verdicts
from sim.figures.style import law_name
from sim.sweep.statistics import cells, paired_differences, parameters

#: Top of the page.
_HEAD = """# Results of the experiments

Generated from data by `{command}`; do not edit. {lead}
*Met*: flags, peaks and bounces (marked *every*) must hold in every flight, other figures by the median of the cell,
then with the count of flights where not all hold; a flight without the figure makes it a no.
Medians over the flights of a cell, in brackets their 95 % bootstrap interval; *done* counts the flights that ended as
planned. Differences are analytic law minus QP law, flown with the same seeds; **bold** where the interval excludes
zero. What each experiment flies and what the paper reports is in [experiments.md](../experiments.md).

"""


def results_page(
    flown: Sequence[tuple[Experiment, pl.DataFrame, dict[str, tuple[str, Path]]]], lead: str, command: str
) -> str:
    """Markdown text of the page.

    Args:
        flown: Experiments with their tables and the caption and file of their figures, files relative to the page.
        lead: A sentence on what was flown.
        command: The command that flew it.
    """
    text = _HEAD.format(command=command, lead=lead)
    text += "## What the QP law is held to\n\n" + _summary(flown)
    text += "\n## Where the QP helps, and where it does not\n\n" + _balance(flown)
    for experiment, table, figures in flown:
        text += f"\n## {experiment.title}\n\n{experiment.about}\n\n"
        text += f"**Published:** {experiment.paper}\n\n"
        text += f"To redo it: `ibvs-qp experiment {experiment.name}`\n\n"
        text += _table(experiment, table) + "\n" + _differences(experiment, table)
        text += _failures(table)
        for caption, file in figures.values():
            text += f"![{caption}]({file.as_posix()})\n\n*{caption}.*\n\n"
    return text


def _balance(flown: Sequence[tuple[Experiment, pl.DataFrame, dict[str, tuple[str, Path]]]]) -> str:
    """Counts per experiment, then every figure in which the analytic law is surely better."""
    heads = (
        "experiment",
        "flights done, QP",
        "flights done, analytic",
        "QP surely better",
        "no sure difference",
        "analytic surely better",
    )
    lines = ["| " + " | ".join(heads) + " |", "|" + "---|" * len(heads)]
    losses = []
    for experiment, table, _ in flown:
        paired = [entry for entry in balance(experiment, table) if entry.column.better]
        count = {winner: sum(entry.winner == winner for entry in paired) for winner in ("qp", "", "paper")}
        both = [table.filter(pl.col("law") == law)["completed"] for law in ("qp", "paper")]
        done = [f"{int(column.sum())} of {column.len()}" for column in both]
        lines.append(f"| {experiment.name} | {done[0]} | {done[1]} | {count['qp']} | {count['']} | {count['paper']} |")
        losses += [_loss(experiment, entry) for entry in paired if entry.winner == "paper"]
    text = "Figures of cells that both laws flew with the same seeds; surely: the interval excludes zero.\n\n"
    text += "\n".join(lines) + "\n"
    if losses:
        text += (
            "\nThe analytic law with clipping is surely better in (analytic minus QP):\n\n" + "\n".join(losses) + "\n"
        )
    return text


def _loss(experiment: Experiment, entry: Paired) -> str:
    column, cell = entry.column, _words(experiment, entry.params)
    figures = " to ".join(f"{value:+.{column.digits}f}" for value in (entry.low, entry.high))
    return (
        f"- {experiment.name}, {entry.variant}, {cell}: {column.label} {entry.median:+.{column.digits}f} {column.unit} "
        f"({figures}, {entry.pairs} pairs)"
    )


def _summary(flown: Sequence[tuple[Experiment, pl.DataFrame, dict[str, tuple[str, Path]]]]) -> str:
    heads = ("experiment", "figure", "cell", "bound", "median", "worst flight", "flights within", "met")
    lines = ["| " + " | ".join(heads) + " |", "|" + "---|" * len(heads)]
    for experiment, table, _ in flown:
        listed = verdicts(experiment, table)
        lines += [_verdict_line(experiment, verdict, telling(listed, verdict)) for verdict in listed]
    return "\n".join(lines) + "\n"


def _verdict_line(experiment: Experiment, verdict: Verdict, shown: dict[str, Any]) -> str:
    criterion = verdict.criterion
    sign, unit = (">=" if criterion.least else "<="), f" {criterion.unit}" if criterion.unit else ""
    sign += " every" if criterion.every else ""
    cell = _words(experiment, shown) or "all"
    if criterion.variant != "standard":
        cell += f", {criterion.variant}"
    return (
        f"| {experiment.name} | {criterion.text} | {cell} | {sign} {verdict.bound:.4g}{unit} | "
        f"{_number(verdict.median, unit)} | {_number(verdict.worst, unit)} | {verdict.held} of {verdict.n} | "
        f"{verdict.words if verdict.met else '**no**'} |"
    )


def _number(value: float, unit: str) -> str:
    return f"{value:.3g}{unit}" if np.isfinite(value) else "–"


def _words(experiment: Experiment, params: dict[str, Any]) -> str:
    return ", ".join(f"{experiment.params.get(key, key)} {_param(value)}" for key, value in params.items())


def _param(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


def _table(experiment: Experiment, table: pl.DataFrame) -> str:
    columns = [column for column in experiment.columns if column.metric in table.columns]
    heads = [*experiment.params.values(), "variant", "law", "done"]
    heads += [column.label + (f" [{column.unit}]" if column.unit else "") for column in columns]
    lines = ["| " + " | ".join(heads) + " |", "|" + "---|" * len(heads)]
    for cell in cells(table):
        row = [_param(cell["params"].get(name, "")) for name in experiment.params]
        row += [cell["variant"], law_name(cell["law"]), f"{cell['completed']} of {cell['n']}"]
        row += [_interval(cell["metrics"].get(column.metric), column) for column in columns]
        lines.append("| " + " | ".join(row) + " |")
    used = [name for name in VARIANTS if name in table["variant"].unique().to_list()]
    notes = "; ".join(f"*{name}*: {VARIANTS[name].words}" for name in used)
    return "\n".join(lines) + f"\n\nVariants: {notes}.\n"


def _interval(figure: dict[str, float] | None, column: Column) -> str:
    if figure is None or not np.isfinite(figure["median"]):
        return "–"
    middle, low, high = (f"{column.scale * figure[name]:.{column.digits}f}" for name in ("median", "low", "high"))
    return middle if low == high else f"{middle} ({low} to {high})"


def _differences(experiment: Experiment, table: pl.DataFrame) -> str:
    columns = [column for column in experiment.columns if column.metric in table.columns]
    found = [entry for entry in paired_differences(table, [column.metric for column in columns]) if entry["n"] > 1]
    if not found:
        return ""
    heads = [*experiment.params.values(), "variant", "pairs"]
    heads += [column.label + (f" [{column.unit}]" if column.unit else "") for column in columns]
    lines = ["Analytic law minus QP law:", "", "| " + " | ".join(heads) + " |", "|" + "---|" * len(heads)]
    for entry in found:
        row = [_param(entry["params"].get(name, "")) for name in experiment.params]
        row += [entry["variant"], str(entry["n"])]
        for column in columns:
            figure = entry["differences"].get(column.metric)
            text = _interval(figure, column)
            sure = figure is not None and (figure["low"] > 0.0 or figure["high"] < 0.0)
            row.append(f"**{text}**" if sure else text)
        lines.append("| " + " | ".join(row) + " |")
    return "\n".join(lines) + "\n\n"


def _failures(table: pl.DataFrame) -> str:
    failed = table.filter(~pl.col("completed"))
    if not failed.height:
        return ""
    lines = ["Flights that did not end as planned:", ""]
    for row in failed.iter_rows(named=True):
        params = ", ".join(f"{name} {_param(value)}" for name, value in parameters(row).items())
        lines.append(f"- {law_name(row['law'])}, {row['variant']}, {params}, seed {row['seed']}: {row['reason']}")
    return "\n".join(lines) + "\n\n"
