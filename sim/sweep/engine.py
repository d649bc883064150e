"""Run a design: blocks that are on disk are skipped, the others flown in processes, rows joined in design order."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import polars as pl

from sim.sweep.design import Run
from sim.sweep.fingerprint import block_hash
from sim.sweep.flying import fly_block
from sim.sweep.parts import join, part_file

#: Told the number of runs finished, the number of all, and how many of the finished were on disk already.
SweepProgress = Callable[[int, int, int], None]


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
    runs: Sequence[Run],
    folder: Path,
    *,
    workers: int = 1,
    block_runs: int = 1,
    progress: SweepProgress | None = None,
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
    """
    folder.mkdir(parents=True, exist_ok=True)
    blocks = [runs[start : start + block_runs] for start in range(0, len(runs), block_runs)]
    names = [block_hash(block) for block in blocks]
    missing = [(block, name) for block, name in zip(blocks, names, strict=True) if not part_file(folder, name).exists()]
    reused = done = len(runs) - sum(len(block) for block, _ in missing)
    tell = progress or (lambda *_: None)
    tell(done, len(runs), reused)
    interrupted = False
    try:
        for flown in _fly(missing, folder, workers):
            done += flown
            tell(done, len(runs), reused)
    except KeyboardInterrupt:
        interrupted = True
    files = [part_file(folder, name) for name in names]
    return SweepResult(table=join([file for file in files if file.exists()]), interrupted=interrupted, reused=reused)


def _fly(blocks: Sequence[tuple[Sequence[Run], str]], folder: Path, workers: int) -> Iterator[int]:
    """Number of runs of each block as it is finished, in any order."""
    if workers == 1 or len(blocks) <= 1:
        for block, name in blocks:
            yield fly_block(block, name, folder, worker=False)
        return
    import joblib
    from joblib.externals.loky import get_reusable_executor

    parallel = joblib.Parallel(n_jobs=workers, return_as="generator_unordered", batch_size=1)  # type: ignore[arg-type]
    with joblib.parallel_config(backend="loky", inner_max_num_threads=1):
        try:
            calls = (joblib.delayed(fly_block)(block, name, folder, worker=True) for block, name in blocks)
            for flown in parallel(calls):
                yield int(flown or 0)
        except KeyboardInterrupt:
            # What is in the air is lost: its part is not written, and a run that starts again flies it anew.
            get_reusable_executor().shutdown(wait=False, kill_workers=True)
            raise
