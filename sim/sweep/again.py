"""Figures of flown flights computed again from their kept traces, without a flight."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import polars as pl

from ibvs_qp.config.errors import ConfigError, IbvsQpError
from sim.flight.trace_log import load_trace
from sim.sweep.design import Run
from sim.sweep.fingerprint import configuration_hash
from sim.sweep.flying import Row, figures_of, outcome
from sim.sweep.parts import HEAD, PARAM, frame
from sim.sweep.statistics import parameters

#: Flight within a table: experiment, law, variant, seed, parameters.
Key = tuple[Any, ...]


def score_again(
    runs: Sequence[Run], table: pl.DataFrame, folder: Path, workers: int = 1
) -> tuple[pl.DataFrame, list[Run]]:
    """Rows of the runs whose traces were kept, with the figures of the present code, and the runs without a trace.

    Args:
        runs: The design.
        table: Rows of earlier flights of the same design, by any version of the code.
        folder: Folder to which their traces are relative.
        workers: Processes side by side.

    Returns:
        The rows in the order of the design, and the other runs: without a trace, or flown with another configuration.
        A flight that was refused keeps its row.
    """
    import joblib

    rows = {_key(row, parameters(row)): row for row in table.to_dicts()}
    flown = [(run, row) for run in runs if (row := rows.get(_key_of(run))) is not None and _is_kept(run, row, folder)]
    scored = joblib.Parallel(n_jobs=workers)(joblib.delayed(_scored)(run, row, folder) for run, row in flown)
    kept = {id(run) for run, _ in flown}
    return frame([row for row in scored if row is not None]), [run for run in runs if id(run) not in kept]


def in_order(runs: Sequence[Run], tables: Sequence[pl.DataFrame]) -> pl.DataFrame:
    """One table of several, its rows in the order of the design."""
    joined = pl.concat(tables, how="diagonal_relaxed")
    place = {_key_of(run): index for index, run in enumerate(runs)}
    order = [place[_key(row, parameters(row))] for row in joined.to_dicts()]
    return joined[sorted(range(len(order)), key=order.__getitem__)]


def _is_kept(run: Run, row: Row, folder: Path) -> bool:
    """Whether the flight of a row is that of a run, and its trace is there; a refused one has none."""
    if not row["config_hash"]:
        return True
    return row["config_hash"] == configuration_hash(run) and bool(row["trace"] and (folder / row["trace"]).is_file())


def _scored(run: Run, row: Row, folder: Path) -> Row:
    kept = {
        name: value for name, value in row.items() if name in HEAD or (name.startswith(PARAM) and value is not None)
    }
    if not row["trace"]:
        return kept
    file = folder / row["trace"]
    try:
        trace = load_trace(file)
        return kept | outcome(trace) | figures_of(run, trace)
    except (IbvsQpError, AttributeError, KeyError) as error:  # damaged, or of a version without an input of a figure
        reason = error if isinstance(error, IbvsQpError) else f"{file} lacks {error}"
        raise ConfigError(f"{reason}; remove it, and the flight is flown again") from None


def _key_of(run: Run) -> Key:
    row = {"experiment": run.experiment, "law": run.law, "variant": run.variant, "seed": run.seed}
    return _key(row, run.params)


def _key(row: Row, params: Row) -> Key:
    names = ("experiment", "law", "variant", "seed")
    return (*(row[name] for name in names), tuple(sorted(params.items())))
