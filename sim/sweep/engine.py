"""Run a design: blocks that are on disk are skipped, the others flown by a pool, rows joined in design order."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import polars as pl

from sim.sweep.design import Design, Listed, Run
from sim.sweep.parts import join, part_file, write_part
from sim.sweep.pools import Pool, local_pool

#: Told the number of runs finished, the number of all, and how many of the finished were on disk already.
SweepProgress = Callable[[int, int, int], None]
#: Told the flying time expected of what this sweep has flown, and of all that it had to fly [s].
SweepTime = Callable[[float, float], None]


@dataclass(frozen=True, kw_only=True)
class SweepResult:
    """Outcome of a sweep.

    Attributes:
        table: One row per finished run, in the order of the design, whatever finished first.
        interrupted: Whether Ctrl-C ended it early.
        reused: Runs that were on disk already.
    """

    table: pl.DataFrame
    interrupted: bool
    reused: int


def run_sweep(
    runs: Sequence[Run] | Design,
    folder: Path,
    *,
    workers: int = 1,
    block_runs: int = 1,
    progress: SweepProgress | None = None,
    timed: SweepTime | None = None,
    pool: Pool | None = None,
) -> SweepResult:
    """Fly every run of a design that is not on disk yet.

    A part is named by the hash of its runs and of the code that flies them, so an interrupted sweep goes on where it
    stopped, and a changed setting or controller is flown anew. Ctrl-C keeps the finished parts.

    Args:
        runs: The design; its order is the order of the table.
        folder: Where parts and logs are kept.
        workers: Processes side by side; the table does not depend on it.
        block_runs: Runs per part.
        progress: Told about every finished block.
        timed: Told their expected flying time, as flights of one design differ in length.
        pool: Flies the blocks instead of `workers` processes of this computer.
    """
    folder.mkdir(parents=True, exist_ok=True)
    design: Design = Listed(runs) if isinstance(runs, Sequence) else runs
    count = len(design)
    blocks = [design.block(start, min(start + block_runs, count)) for start in range(0, count, block_runs)]
    named = [(block, block.name) for block in blocks]
    missing = [(block, name) for block, name in named if not part_file(folder, name).exists()]
    reused = done = count - sum(len(block) for block, _ in missing)
    tell = progress or (lambda *_: None)
    tell(done, count, reused)
    expected = {name: float(getattr(block, "expected_s", len(block))) for block, name in missing} if timed else {}
    flown_s, all_s = 0.0, sum(expected.values())
    interrupted = False
    try:
        for name, rows in (pool or local_pool(workers))(missing, folder):
            write_part(part_file(folder, name), rows)
            done += len(rows)
            if timed is not None:
                flown_s += expected[name]
                timed(flown_s, all_s)
            tell(done, count, reused)
    except KeyboardInterrupt:
        interrupted = True
    files = [part_file(folder, name) for _, name in named]
    return SweepResult(table=join([file for file in files if file.exists()]), interrupted=interrupted, reused=reused)
