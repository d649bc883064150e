"""Run a design: blocks already on disk are skipped, the others flown by a pool, rows joined in design order."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import polars as pl

from sim.sweep.design import Run, listed_block
from sim.sweep.parts import frame, part_file, read_tables, write_table
from sim.sweep.planned import Planned
from sim.sweep.pools import Pool, fly_local

#: Receives the finished runs, all runs, the runs already on disk before, and the finished fraction 0..1 of the expected
#: flying time of the others.
SweepProgress = Callable[[int, int, int, float], None]


@dataclass(frozen=True, kw_only=True)
class SweepResult:
    """Outcome of a sweep."""

    table: pl.DataFrame  # one row per finished run, in the order of the design
    interrupted: bool  # whether Ctrl-C ended it early
    reused: int  # runs that were on disk already


def run_sweep(
    runs: Sequence[Run] | Planned,
    folder: Path,
    *,
    workers: int = 1,
    block_runs: int = 1,
    progress: SweepProgress | None = None,
    pool: Pool | None = None,
) -> SweepResult:
    """Fly every run of a design that is not on disk yet.

    The name of a part is the hash of its runs and of their code: an interrupted sweep continues where it
    stopped, and flights with a changed setting or controller are flown anew. Ctrl-C leaves the finished parts on disk.

    Args:
        runs: The design; its order is the order of the table.
        folder: Folder of parts and logs.
        workers: Processes side by side; the table does not depend on it.
        block_runs: Runs per part.
        progress: Called after every finished block.
        pool: Flies the blocks instead of `workers` processes of this computer.
    """
    folder.mkdir(parents=True, exist_ok=True)
    count, block = len(runs), runs.block if isinstance(runs, Planned) else lambda a, b: listed_block(runs[a:b])
    blocks = [block(start, min(start + block_runs, count)) for start in range(0, count, block_runs)]
    missing = {each.name: each for each in blocks if not part_file(folder, each.name).exists()}
    expected_s = sum(each.expected_s for each in missing.values())
    reused = done = count - sum(each.count for each in missing.values())
    flown_s, interrupted, report = 0.0, False, progress or (lambda *_: None)
    report(done, count, reused, 0.0)
    try:
        fly = pool or functools.partial(fly_local, workers=workers)
        for name, rows in fly(list(missing.values()), folder):
            write_table(part_file(folder, name), frame(rows))
            done, flown_s = done + len(rows), flown_s + missing[name].expected_s
            report(done, count, reused, flown_s / expected_s)
    except KeyboardInterrupt:
        interrupted = True
    files = [part_file(folder, each.name) for each in blocks]
    return SweepResult(
        table=read_tables(file for file in files if file.exists()), interrupted=interrupted, reused=reused
    )
