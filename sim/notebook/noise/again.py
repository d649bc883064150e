"""A row of the table flown again: its design looked up by cell, law and seed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from sim.experiments import Choice
from sim.experiments import designs as experiment_runs
from sim.flight.closed_loop import fly
from sim.flight.trace import Trace
from sim.notebook.noise.sample import sample_runs
from sim.notebook.noise.table import FORCE, VS
from sim.sweep.design import Run
from sim.sweep.fingerprint import code_hash, configuration_hash

#: More seeds per cell than any sweep of this design has.
_MOST_SEEDS = 10


@dataclass(frozen=True, kw_only=True)
class Again:
    """A flight flown again.

    Attributes:
        run: Its design.
        trace: The flight.
        figures: What was measured on it.
        same: Whether settings and code are those of the table, so that the figures must be the same to the bit.
    """

    run: Run
    trace: Trace
    figures: dict[str, float]
    same: bool


def find_run(row: dict[str, Any]) -> Run:
    """The run of a row: the one with its configuration if there is one, else the same cell of the sample.

    Raises:
        LookupError: When no design has such a cell, law and seed.
    """
    designs = [sample_runs(_MOST_SEEDS)]
    designs += [experiment_runs("noise-sweep", Choice(features=features)) for features in ("geometric", "rendered")]
    alike = [
        run
        for design in designs
        for run in design
        if run.law == row["law"]
        and run.seed == row["seed"]
        and (run.params["sigma_vs"], run.params["sigma_f_n"]) == (row[VS], row[FORCE])
    ]
    if not alike:
        raise LookupError(f"no flight with sigma_vs {row[VS]:g}, sigma_f {row[FORCE]:g} N, seed {row['seed']}")
    return next((run for run in alike if configuration_hash(run) == row.get("config_hash")), alike[0])


def fly_again(row: dict[str, Any]) -> Again:
    """Fly the run of a row in this process."""
    run = find_run(row)
    plan = run.plan
    trace = fly(plan.scene, plan.options, config=plan.config, job=plan.job, faults=plan.faults)
    same = (configuration_hash(run), code_hash()) == (row.get("config_hash"), row.get("code_hash"))
    return Again(run=run, trace=trace, figures=run.measure(trace), same=same)


def row_named(rows: list[dict[str, Any]], name: str) -> dict[str, Any]:
    """The row of a name made by `row_name`."""
    return next(row for row in rows if row_name(row) == name)


def row_name(row: dict[str, Any]) -> str:
    """Law, cell and seed of a row in words."""
    return f"{row['law']}, sigma_vs {row[VS]:g}, sigma_f {row[FORCE]:g} N, seed {row['seed']}"
