"""Cost of a sweep, and speed-up of several processes over one; prints one line of JSON.

Run as ``python benchmarks/sweep_scaling.py --runs 1000``; a run is a flight of about seven seconds that touches the
board, 0.25 s of processor time on a quiet core. Blocks and parts are those of ``ibvs-qp sweep``. The start-up of the
processes is subtracted, so that few runs suffice. On a busy computer trust `cpu_ratio`: the processor time of one
process over that of several for the same runs, 1 for a perfect split.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import resource
import tempfile
import time
import tomllib
from pathlib import Path

from joblib.externals.loky import get_reusable_executor

from sim.sweep import Planned, run_sweep
from sim.sweep.engine import Pool, cluster_pool
from sim.sweep.spec import parse_spec

SPEC = """
name = "scaling"
laws = ["qp"]
seeds = {runs}
[fixed]
scene.start.distance_m = 0.15
job.hold_s = 0.2
"""
#: Runs per block as in the shipped specs, but never so many that a process idles.
BLOCK = 10


def processor_s() -> float:
    """Processor time of this process and of its finished children [s]."""
    usages = map(resource.getrusage, (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(usage.ru_utime + usage.ru_stime for usage in usages)


def timed(runs: int, workers: int, folder: Path, dask: bool = False) -> tuple[float, float]:
    """Wall-clock time of a sweep by warm processes, and processor time from their start to their end [s]."""
    before = processor_s()
    with contextlib.ExitStack() as stack:
        pool = stack.enter_context(cluster_pool(None, workers)) if dask else None
        sweep(2 * workers, workers, folder / f"warm-{runs}-{workers}-{dask}", pool)
        begin = time.perf_counter()
        sweep(runs, workers, folder / f"runs-{runs}-{workers}-{dask}", pool)
        wall = time.perf_counter() - begin
    if workers > 1 and not dask:
        get_reusable_executor().shutdown(wait=True)
    return wall, processor_s() - before


def sweep(runs: int, workers: int, folder: Path, pool: Pool | None) -> None:
    """Fly a sweep of some runs."""
    if runs:
        design = Planned(parse_spec(tomllib.loads(SPEC.format(runs=runs)), folder))
        block = max(1, min(BLOCK, runs // (4 * workers)))
        table = run_sweep(design, folder, workers=workers, block_runs=block, pool=pool).table
        assert table.height == runs and table["completed"].all()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=1000, help="runs of the sweep")
    parser.add_argument("--workers", type=int, default=2, help="processes side by side")
    parser.add_argument("--dask", action="store_true", help="fly on a local Dask cluster as well")
    options = parser.parse_args()
    runs, many = options.runs, options.workers
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        start_one, start_many = (timed(0, workers, folder)[1] for workers in (1, many))
        (wall_one, cpu_one), (wall_many, cpu_many) = (timed(runs, workers, folder) for workers in (1, many))
        result = {
            "runs": runs,
            "workers": many,
            "load": os.getloadavg()[0],
            "wall_s": {"one": wall_one, "many": wall_many},
            "wall_ratio": wall_one / wall_many,
            "cpu_ratio": (cpu_one - start_one) / (cpu_many - start_many),
            "cpu_per_run_s": (cpu_one - start_one) / runs,
            "cpu_start_s": start_many / many,
        }
        if options.dask:
            wall_dask, _ = timed(runs, many, folder, dask=True)
            result |= {"dask_wall_s": wall_dask, "dask_wall_ratio": wall_one / wall_dask}
    print(json.dumps(result))


if __name__ == "__main__":
    main()
