"""Fly one block of a design in this process and leave its part on disk."""

from __future__ import annotations

import math
import signal
import traceback
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

from ibvs_qp.errors import IbvsQpError
from ibvs_qp.settings import dump_toml
from sim.closed_loop import fly
from sim.flight_log import save_log
from sim.flights import INTERRUPTED
from sim.sweep.design import Run
from sim.sweep.fingerprint import code_hash, configuration_hash
from sim.sweep.parts import PARAM, part_file, write_part
from sim.trace import Trace


def fly_block(runs: Sequence[Run], name: str, folder: Path, worker: bool) -> int:
    """Fly the runs of a block and write its part.

    Args:
        runs: The block.
        name: Its hash.
        folder: Where the parts are.
        worker: Whether this is a process of its own, which leaves Ctrl-C to its parent.

    Returns:
        Number of runs flown.

    Raises:
        KeyboardInterrupt: On Ctrl-C; nothing is written then.
    """
    if worker:
        signal.signal(signal.SIGINT, signal.SIG_IGN)
    import cv2

    cv2.setNumThreads(1)  # the runs share the cores as processes
    rows = [_row(run, f"{name}-{index}", folder) for index, run in enumerate(runs)]
    write_part(part_file(folder, name), rows)
    return len(rows)


def _row(run: Run, name: str, folder: Path) -> dict[str, Any]:
    """Fly one run; one that fails is a row with the reason and no figures."""
    row: dict[str, Any] = {
        "experiment": run.experiment,
        "law": run.law,
        "variant": run.variant,
        "seed": run.seed,
        "completed": False,
        "config_hash": configuration_hash(run),
        "code_hash": code_hash(),
        "version": version("ibvs-qp"),
        "log": None,
        **{PARAM + key: value for key, value in run.params.items()},
    }
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
    row |= {"completed": bool(trace.completed), "reason": trace.reason}
    if run.keep:
        row["log"] = _keep(trace, folder / "logs" / name)
    figures = run.measure(trace)
    return row | {key: None if math.isnan(value) else float(value) for key, value in figures.items()}


def _keep(trace: Trace, folder: Path) -> str:
    """Write the log of a flight where `sim.flight_log.load_run` reads it."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "scene.toml").write_text(dump_toml(trace.scene), encoding="utf-8")
    trace.canvas = None  # a picture of the board is the run folder's affair, and large
    save_log(folder / "log.npz", {trace.law: trace})
    return f"{folder.parent.name}/{folder.name}"
