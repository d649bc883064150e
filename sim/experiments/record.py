"""Files in the folder of an experiment: table, summary, figures and the results page."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import polars as pl

from sim.experiments import ALL
from sim.experiments.figures import Results, draw
from sim.experiments.page import Fields, results_page
from sim.experiments.spec import Experiment
from sim.experiments.verdict import Verdict, verdicts
from sim.figures.style import save, styled
from sim.report.rundir import write_json
from sim.storage.atomic import write_text
from sim.sweep.design import Run
from sim.sweep.flying import score_again
from sim.sweep.parts import read_tables, write_table
from sim.sweep.statistics import cells, false_claims, paired_differences

SCHEMA = 1
#: Folder of parts and logs, under the folder of the experiment.
PARTS = "parts"
#: The results page.
PAGE = "results.md"
FIGURES = "figures"
#: Facts of a run that the summary repeats.
_FACTS = ("command", "version", "seed", "features", "world", "interrupted", "wall_time_s")


def data_file(folder: Path, name: str) -> Path:
    """Table of an experiment."""
    return folder / f"{name}.parquet"


def summary(
    name: str, experiments: Sequence[Experiment], table: pl.DataFrame, folder: Path, facts: dict[str, Any]
) -> dict[str, Any]:
    """The JSON of the contract, with paired differences and verdicts in addition to the cells.

    Args:
        name: Experiment, or "all".
        experiments: The flown experiments.
        table: Their rows.
        folder: Folder of the data file.
        facts: quick, seed, features, world, version, command, interrupted, wall_time_s.
    """
    of_all = {column.metric for each in experiments for column in each.columns if column.of_all}
    listed = cells(table, of_all) if table.height else []
    if name == ALL:
        for cell in listed:
            cell["params"] = {"experiment": cell["experiment"], **cell["params"]}
    return {
        "schema": SCHEMA,
        "name": name,
        "quick": facts["quick"],
        "data_file": str(data_file(folder, name)),
        "run_dir": str(folder),
        **{key: facts[key] for key in _FACTS},
        "false_claims": false_claims(table),
        "cells": listed,
        "differences": paired_differences(table) if table.height else [],
        "verdicts": [
            _verdict_row(each.name, verdict) for each in experiments for verdict in verdicts(each, rows_of(table, each))
        ],
    }


def _verdict_row(name: str, verdict: Verdict) -> dict[str, Any]:
    criterion = verdict.criterion
    return {
        "experiment": name,
        "figure": criterion.text,
        "metric": criterion.metric,
        "law": criterion.law,
        "variant": criterion.variant,
        "params": verdict.params,
        "cell": verdict.place,
        "bound": verdict.bound,
        "least": criterion.least,
        "unit": criterion.unit,
        "median": verdict.median,
        "worst": verdict.worst,
        "held": verdict.within,
        "n": verdict.n,
        "every": criterion.every,
        "met": verdict.met,
        "words": verdict.words,
    }


def rows_of(table: pl.DataFrame, experiment: Experiment) -> pl.DataFrame:
    """Rows of one experiment, without columns that are empty there."""
    rows = table.filter(pl.col("experiment") == experiment.name)
    return rows[[series.name for series in rows if series.null_count() < rows.height or series.name == "log"]]


def write_tables(folder: Path, name: str, experiments: Sequence[Experiment], table: pl.DataFrame) -> None:
    """Write the table, and for ``all`` one per experiment too."""
    write_table(data_file(folder, name), table)
    for experiment in experiments if name == ALL else ():
        write_table(data_file(folder, experiment.name), rows_of(table, experiment))


def flights_again(folder: Path, name: str, runs: Sequence[Run], workers: int) -> tuple[pl.DataFrame, list[Run]]:
    """Rows by the traces of a folder, and the runs without a trace (`sim.sweep.flying`)."""
    file = data_file(folder, name)
    return score_again(runs, read_tables([file] if file.exists() else []), folder / PARTS, workers)


def write_summary(folder: Path, content: dict[str, Any]) -> None:
    """Write the JSON."""
    write_json(folder / f"{content['name']}.json", content)


def write_page(folder: Path, experiments: Sequence[Experiment], table: pl.DataFrame, lead: str, command: str) -> Path:
    """Draw every figure, remove those of earlier pages, and write the results page; returns its file.

    Args:
        folder: Folder of the page, with logs in its ``parts``.
        experiments: The flown experiments.
        table: Their rows.
        lead: A sentence on the flights.
        command: Command that repeats one experiment, with ``{name}`` in the place of its name.
    """
    flown = []
    with styled():
        for experiment in experiments:
            rows = rows_of(table, experiment)
            if not rows.height:
                continue
            figures = {}
            for title, (caption, figure) in draw(Results(experiment, rows, folder / PARTS)).items():
                figures[title] = (caption, Path(FIGURES) / f"{title}.png")
                save(figure, folder / figures[title][1])
            flown.append(Fields(experiment, rows, figures))
    shown = {folder / file for fields in flown for _, file in fields.figures.values()}
    for file in set((folder / FIGURES).glob("*.png")) - shown:
        file.unlink()
    write_text(folder / PAGE, results_page(flown, lead, command))
    return folder / PAGE
