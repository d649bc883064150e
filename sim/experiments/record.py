"""What an experiment leaves in its folder: tables, summary, figures and the results page."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import polars as pl

from sim.experiments import ALL
from sim.experiments.figures import Results, draw
from sim.experiments.page import Section, results_page
from sim.experiments.spec import Experiment
from sim.experiments.variants import REFERENCES
from sim.experiments.verdict import distinguishing, verdicts
from sim.figures.style import save, styled
from sim.report.rundir import as_json
from sim.sweep.paired import paired_differences, variant_differences
from sim.sweep.parts import write_table
from sim.sweep.statistics import cells

SCHEMA = 1
#: Parts and logs lie here, under the folder of the experiment.
PARTS = "parts"
PAGE = "results.md"


def data_file(folder: Path, name: str) -> Path:
    """Table of an experiment."""
    return folder / f"{name}.parquet"


def summary(
    name: str, experiments: Sequence[Experiment], table: pl.DataFrame, folder: Path, facts: dict[str, Any]
) -> dict[str, Any]:
    """The JSON of the contract, with paired differences and verdicts beside the cells.

    Args:
        name: Experiment, or "all".
        experiments: Those flown.
        table: Their rows.
        folder: Where the data file is.
        facts: quick, seed, features, version, command, interrupted, wall_time_s.
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
        **{key: facts[key] for key in ("command", "version", "seed", "features", "interrupted", "wall_time_s")},
        "cells": listed,
        "differences": paired_differences(table) if table.height else [],
        "parts": variant_differences(table, REFERENCES) if table.height else [],
        "verdicts": [
            {
                "experiment": each.name,
                "figure": verdict.criterion.text,
                "metric": verdict.criterion.metric,
                "variant": verdict.criterion.variant,
                "params": verdict.params,
                "cell": distinguishing(listed, verdict),
                "bound": verdict.bound,
                "least": verdict.criterion.least,
                "unit": verdict.criterion.unit,
                "median": verdict.median,
                "worst": verdict.worst,
                "held": verdict.within,
                "n": verdict.n,
                "every": verdict.criterion.every,
                "met": verdict.met,
                "words": verdict.words,
            }
            for each in experiments
            for listed in [verdicts(each, rows_of(table, each))]
            for verdict in listed
        ],
    }


def rows_of(table: pl.DataFrame, experiment: Experiment) -> pl.DataFrame:
    """Rows of one experiment, without columns that it does not have."""
    rows = table.filter(pl.col("experiment") == experiment.name)
    return rows[[series.name for series in rows if series.null_count() < rows.height or series.name in ("log",)]]


def write_tables(folder: Path, name: str, experiments: Sequence[Experiment], table: pl.DataFrame) -> None:
    """Write the table, and for ``all`` one per experiment too."""
    write_table(data_file(folder, name), table)
    for experiment in experiments if name == ALL else ():
        write_table(data_file(folder, experiment.name), rows_of(table, experiment))


def write_summary(folder: Path, content: dict[str, Any]) -> None:
    """Write the JSON."""
    (folder / f"{content['name']}.json").write_text(as_json(content, indent=1) + "\n", encoding="utf-8")


def write_page(
    folder: Path, experiments: Sequence[Experiment], table: pl.DataFrame, lead: str, command: str, name: str = ALL
) -> Path:
    """Draw every figure and write the results page; returns its file.

    Args:
        folder: Where it goes, with logs in its ``parts``.
        experiments: Those flown.
        table: Their rows.
        lead: A sentence on what was flown.
        command: The command that flies one alike, with ``{name}`` where its name goes.
        name: What was flown: an experiment, or "all".
    """
    sections = []
    with styled():
        for experiment in experiments:
            rows = rows_of(table, experiment)
            if not rows.height:
                continue
            figures = {}
            for title, (caption, figure) in draw(Results(experiment, rows, folder / PARTS)).items():
                save(figure, folder / "figures" / f"{title}.png")
                figures[title] = (caption, Path("figures") / f"{title}.png")
            sections.append(Section(experiment=experiment, table=rows, figures=figures))
    (folder / PAGE).write_text(results_page(sections, lead, command, name), encoding="utf-8")
    return folder / PAGE
