"""Files of a run of the fault matrix: the table of flights, the summary, the page."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import polars as pl

from sim.fault_matrix.verdict import Tally, Verdict
from sim.report.rundir import write_json
from sim.sweep.parts import write_table

SCHEMA = 1
#: Folder of the parts, table of all flights, page, summary.
PARTS, TABLE, PAGE, SUMMARY = "parts", "faults.parquet", "faults.md", "faults.json"


def summary(verdicts: Sequence[Verdict], folder: Path, facts: dict[str, Any]) -> dict[str, Any]:
    """Content of the summary and of ``--json``.

    Args:
        verdicts: The rows.
        folder: Folder of the run.
        facts: Of the flights: command, version, seed and so on.
    """
    flown = [verdict for verdict in verdicts if verdict.flown.n]
    return {
        "schema": SCHEMA,
        "name": "faults",
        **facts,
        "run_dir": str(folder),
        "data_file": str(folder / TABLE),
        "rows_met": sum(verdict.met for verdict in flown),
        "rows_flown": len(flown),
        "proves_nothing": [[verdict.row.name, verdict.place] for verdict in verdicts if verdict.proves_nothing],
        "rows": [
            {
                "fault": verdict.row.name,
                "place": verdict.place,
                "met": verdict.met if verdict.flown.n else None,
                "beyond": verdict.row.beyond or None,
                "supervised": _entry(verdict.flown),
                "control": _entry(verdict.control),
                "control_must_fail": verdict.expected.control_fails,
            }
            for verdict in verdicts
        ],
    }


def _entry(tally: Tally) -> dict[str, Any]:
    return {
        "n": tally.n,
        "passed": tally.passed,
        **tally.worst,
        "retreat_s": tally.retreat_s,
        "states": list(tally.states),
        "failures": [
            {"world": world, "seed": seed, "criteria": [criterion.text for criterion in criteria]}
            for world, seed, criteria in tally.failures
        ],
    }


def write(folder: Path, table: pl.DataFrame, content: dict[str, Any], text: str) -> Path:
    """Write table, summary and page; returns the page's file."""
    write_table(folder / TABLE, table)
    write_json(folder / SUMMARY, content)
    file = folder / PAGE
    file.write_text(text, encoding="utf-8")
    return file
