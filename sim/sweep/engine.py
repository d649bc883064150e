"""Run a design: blocks already on disk are skipped, others flown by a pool (local, Dask), rows joined in order."""

from __future__ import annotations

import contextlib
import functools
import logging
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import polars as pl

from ibvs_qp.config.errors import ConfigError, IbvsQpError
from sim.sweep.design import Block, Run, code_hash, listed_block
from sim.sweep.flying import Row, fly_block
from sim.sweep.parts import frame, part_file, read_tables, write_table
from sim.sweep.planned import Planned

#: Flies blocks in any order and yields name and rows of each when it is finished.
Pool = Callable[[Sequence[Block], Path], Iterator[tuple[str, list[Row]]]]
#: Blocks sent to a cluster ahead of time: a growing cluster finds work, and a block is a few kB.
AHEAD = 1000


class WorkerDied(IbvsQpError):
    """A process died without an exception, as after the system ran out of memory."""


def fly_local(blocks: Sequence[Block], folder: Path, workers: int) -> Iterator[tuple[str, list[Row]]]:
    """Blocks in processes of this computer; in this process for one worker or a single block.

    Raises:
        WorkerDied: When a process died.
    """
    if workers == 1 or len(blocks) <= 1:
        yield from (fly_block(block, folder) for block in blocks)
        return
    import joblib
    from joblib.externals.loky import get_reusable_executor
    from joblib.externals.loky.process_executor import BrokenProcessPool

    with joblib.parallel_config(backend="loky", inner_max_num_threads=1):
        try:
            yield from _parallel(blocks, folder, ignore_interrupt=True, n_jobs=workers)
        except KeyboardInterrupt:
            # Blocks in flight are lost: they have no part, and the next start flies them anew.
            get_reusable_executor().shutdown(wait=False, kill_workers=True)
            raise
        except BrokenProcessPool:
            raise _died(folder) from None


def dask_pool(client: Any) -> Pool:
    """The workers of a Dask cluster."""
    return functools.partial(_fly_dask, client=client)


def _fly_dask(blocks: Sequence[Block], folder: Path, client: Any) -> Iterator[tuple[str, list[Row]]]:
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
    blocks: Sequence[Block], folder: Path, ignore_interrupt: bool = False, **settings: Any
) -> Iterator[tuple[str, list[Row]]]:
    import joblib

    parallel = joblib.Parallel(return_as="generator_unordered", batch_size=1, **settings)  # type: ignore[arg-type]
    yield from parallel(joblib.delayed(fly_block)(block, folder, ignore_interrupt) for block in blocks)  # type: ignore[misc]


def _died(folder: Path) -> WorkerDied:
    return WorkerDied(
        f"a flying process died, possibly for lack of memory. Finished blocks are in {folder}: "
        "the same command continues from there, with fewer --jobs if memory was short"
    )


#: Time-outs of the connection to a scheduler, and of the first worker of a cluster [s].
CONNECT_S, FIRST_WORKER_S = 10.0, 120.0


@contextlib.contextmanager
def cluster_pool(scheduler: str | None, workers: int) -> Iterator[Pool]:
    """A pool on a Dask cluster, closed with the context.

    Args:
        scheduler: Address of a running cluster such as ``tcp://head:8786``; None starts one here.
        workers: Processes of the cluster started here.

    Yields:
        The pool.

    Raises:
        ConfigError: When Dask is not installed, the scheduler does not answer, or a worker is unsuitable.
    """
    try:
        import distributed
    except ImportError:
        raise ConfigError(
            "a Dask cluster needs the extra cluster: pip install -c constraints.txt -e '.[cluster]'"
        ) from None
    logging.getLogger("distributed").setLevel(logging.ERROR)
    with contextlib.ExitStack() as stack:
        if scheduler is None:
            settings: dict[str, Any] = {"n_workers": workers, "threads_per_worker": 1, "dashboard_address": None}
            client = distributed.Client(stack.enter_context(distributed.LocalCluster(**settings)))
        else:
            try:
                client = distributed.Client(scheduler, timeout=CONNECT_S, set_as_default=False)
            except (OSError, ValueError, TypeError) as error:
                reason = str(error).split("\n")[0]
                raise ConfigError(
                    f"no Dask scheduler answers at {scheduler} ({reason}); give the address that `dask scheduler` "
                    "prints, such as tcp://head:8786, with --scheduler"
                ) from None
        require_usable(stack.enter_context(client))
        yield dask_pool(client)


def require_usable(client: Any) -> None:
    """Refuse a cluster without workers, with threaded workers, or with another version of the code.

    Raises:
        ConfigError: With the worker and the remedy.
    """
    try:
        client.wait_for_workers(1, timeout=FIRST_WORKER_S)
    except TimeoutError:
        raise ConfigError(
            f"the cluster has no worker after {FIRST_WORKER_S:.0f} s; start one with `dask worker ADDRESS --nthreads 1`"
        ) from None
    for worker, threads in client.nthreads().items():
        if threads != 1:
            raise ConfigError(
                f"worker {worker} has {threads} threads, and flights share the interpreter's lock; "
                f"start it with --nthreads 1 --nworkers {threads}"
            )
    for worker, code in client.run(code_hash).items():
        if code != code_hash():
            raise ConfigError(f"worker {worker} has other code than this computer; install the same version there")


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
