"""Who flies the blocks: this process, processes of this computer, or a cluster; all through joblib, all alike."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from ibvs_qp.config.errors import IbvsQpError
from sim.sweep.design import Block
from sim.sweep.flying import Row, fly_block

#: Flies named blocks in any order and hands over name and rows of each as it is finished.
Pool = Callable[[Sequence[tuple[Block, str]], Path], Iterator[tuple[str, list[Row]]]]
#: Blocks handed to a cluster ahead of time: a cluster that grows finds work waiting, and a block is a few kB.
AHEAD = 1000


class WorkerDied(IbvsQpError):
    """A process that flew died without a word, as one does that the system ends for lack of memory."""


def local_pool(workers: int) -> Pool:
    """This process for one worker, else so many processes of this computer."""
    return fly_here if workers == 1 else functools.partial(fly_apart, workers=workers)


def fly_here(blocks: Sequence[tuple[Block, str]], folder: Path) -> Iterator[tuple[str, list[Row]]]:
    """One block after the other in this process."""
    for block, name in blocks:
        yield fly_block(block, name, folder)


def fly_apart(blocks: Sequence[tuple[Block, str]], folder: Path, workers: int) -> Iterator[tuple[str, list[Row]]]:
    """Blocks in processes of this computer; a single block needs none.

    Raises:
        WorkerDied: When a process died.
    """
    if len(blocks) <= 1:
        yield from fly_here(blocks, folder)
        return
    import joblib
    from joblib.externals.loky import get_reusable_executor
    from joblib.externals.loky.process_executor import BrokenProcessPool

    with joblib.parallel_config(backend="loky", inner_max_num_threads=1):
        try:
            yield from _parallel(blocks, folder, n_jobs=workers, leave_interrupt=True)
        except KeyboardInterrupt:
            # What is in the air is lost: its part is not written, and a run that starts again flies it anew.
            get_reusable_executor().shutdown(wait=False, kill_workers=True)
            raise
        except BrokenProcessPool:
            raise _died(folder) from None


def dask_pool(client: Any) -> Pool:
    """The workers of a Dask cluster, whatever started them."""
    return functools.partial(_fly_dask, client=client)


def _fly_dask(blocks: Sequence[tuple[Block, str]], folder: Path, client: Any) -> Iterator[tuple[str, list[Row]]]:
    import joblib
    from distributed.scheduler import KilledWorker

    if not blocks:
        return
    with joblib.parallel_config(backend="dask", client=client):
        try:
            yield from _parallel(blocks, folder, n_jobs=-1, pre_dispatch=AHEAD)
        except KilledWorker:
            raise _died(folder) from None


def _parallel(
    blocks: Sequence[tuple[Block, str]], folder: Path, leave_interrupt: bool = False, **settings: Any
) -> Iterator[tuple[str, list[Row]]]:
    import joblib

    parallel = joblib.Parallel(return_as="generator_unordered", batch_size=1, **settings)  # type: ignore[arg-type]
    calls = (joblib.delayed(fly_block)(block, name, folder, leave_interrupt) for block, name in blocks)
    yield from parallel(calls)  # type: ignore[misc]


def _died(folder: Path) -> WorkerDied:
    return WorkerDied(
        f"a process that flew died; was it out of memory? Finished blocks are in {folder}: "
        "the same command goes on from there, with fewer --jobs if memory was short"
    )
