"""Fly runs in this process, or compute their figures from kept traces; a failure becomes a row with the reason."""

from __future__ import annotations

import math
import traceback
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

import polars as pl

from ibvs_qp.config.errors import ConfigError, IbvsQpError
from ibvs_qp.config.settings import dump_toml
from sim.evaluate.truth import Assessment
from sim.flight.closed_loop import fly
from sim.flight.flight_log import save_log
from sim.flight.stop import ignore_stop
from sim.flight.trace import INTERRUPTED, Trace
from sim.flight.trace_log import load_trace, save_trace
from sim.storage.atomic import write_text
from sim.sweep.design import Block, Refusal, Run, code_hash, configuration_hash
from sim.sweep.parts import HEAD, PARAM, frame
from sim.sweep.statistics import parameters

#: Ending of the file of a flight's trace.
TRACE = ".trace.npz"
#: Beginning of the reason of a flight that the pilot claims and the truth does not complete.
FALSE_CLAIM = "false claim"
#: A row of the table: column to value.
Row = dict[str, Any]


def fly_block(block: Block, folder: Path, ignore_interrupt: bool = False) -> tuple[str, list[Row]]:
    """Fly the runs of a block.

    Args:
        block: The runs.
        folder: Folder of logs.
        ignore_interrupt: Whether only the parent of this process handles Ctrl-C and SIGTERM.

    Returns:
        The name of the block, and a row per run.

    Raises:
        KeyboardInterrupt: On Ctrl-C; the block is then lost.
    """
    if ignore_interrupt:
        ignore_stop()
    return block.name, [fly_run(run, folder / "logs" / f"{block.name}-{k}") for k, run in enumerate(block.make())]


def fly_run(run: Run | Refusal, log: Path | None = None) -> Row:
    """Fly one run; a failed one is a row with the reason and without figures.

    Args:
        run: The run.
        log: Folder of its log, if the run stores one; its trace goes next to it.

    Raises:
        KeyboardInterrupt: On Ctrl-C.
    """
    import cv2

    cv2.setNumThreads(1)  # the runs use the cores as processes
    row: Row = {
        "experiment": run.experiment,
        "law": run.law,
        "variant": run.variant,
        "seed": run.seed,
        "completed": False,
        "claimed": False,
        "config_hash": None,
        "code_hash": code_hash(),
        "version": version("ibvs-qp"),
        "log": None,
        "trace": None,
        **{PARAM + key: value for key, value in run.params.items()},
    }
    if isinstance(run, Refusal):
        return {**row, "reason": f"refused: {run.reason}"}
    row["config_hash"] = configuration_hash(run)
    plan = run.plan
    try:
        trace = fly(plan.scene, plan.options, config=plan.config, job=plan.job, faults=plan.faults)
    except IbvsQpError as error:
        return {**row, "reason": f"refused: {error}"}
    except Exception as error:
        where = traceback.extract_tb(error.__traceback__)[-1]
        return {**row, "reason": f"error: {type(error).__name__}: {error} ({Path(where.filename).name}:{where.lineno})"}
    if trace.reason == INTERRUPTED:
        raise KeyboardInterrupt
    row |= outcome(trace)
    if run.keep and log is not None:
        row["log"] = _store(trace, log)
    if run.trace and log is not None:
        save_trace(file := log.parent / f"{log.name}{TRACE}", trace)
        row["trace"] = f"{file.parent.name}/{file.name}"
    return row | figures_of(run, trace)


def figures_of(run: Run, trace: Trace) -> Row:
    """Every figure that the run measures; None without data."""
    return {key: None if math.isnan(value) else float(value) for key, value in run.measure(trace).items()}


def outcome(trace: Trace) -> Row:
    """Whether a flight ended as planned, by the truth and by the pilot, and why it ended; a false claim has failed."""
    assessment, claimed = Assessment(trace), bool(trace.claimed)
    completed, reason = assessment.completed, trace.reason
    if completed != claimed:
        reason = f"{FALSE_CLAIM}: {assessment.shortfall}" if claimed else f"not claimed: {reason}"
    return {"completed": completed and claimed, "claimed": claimed, "reason": reason}


def _store(trace: Trace, folder: Path) -> str:
    """Write the log of a flight in the layout of `sim.flight.flight_log.load_run`."""
    write_text(folder / "scene.toml", dump_toml(trace.scene))
    trace.canvas = None  # the picture of the board is large, and only a run folder shows it
    save_log(folder / "log.npz", {trace.law: trace})
    return f"{folder.parent.name}/{folder.name}"


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
