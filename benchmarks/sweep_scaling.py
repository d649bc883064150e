"""What a sweep costs, and how much faster two processes fly it than one; prints one line of JSON.

Run as ``python benchmarks/sweep_scaling.py --runs 1000``; a run is a flight of about seven seconds that touches the
board, a second of processor time. Blocks and parts are those of ``ibvs-qp sweep``. Start-up of the processes is
measured by itself, so that few runs tell what many cost. On a computer that others use as well, `cpu_ratio` is the figure
to trust: the processor time of one process over that of two for the same runs, 1 when nothing is lost to sharing.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import tempfile
import time
from pathlib import Path

SPEC = """
name = "scaling"
laws = ["qp"]
seeds = {runs}
block_runs = {block}
[fixed]
scene.start.distance_m = 0.15
job.hold_s = 0.2
"""
#: Runs per block: what an interrupt may lose, here as in the shipped specs, but never so many that a process idles.
BLOCK = 10


def children_s() -> float:
    """Processor time of this process and of those it waited for [s]."""
    usages = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(usage.ru_utime + usage.ru_stime for usage in usages)


def fly(runs: int, workers: int, folder: Path, dask: bool = False) -> tuple[float, float]:
    """Wall-clock and processor time of a sweep, processes warm [s]."""
    import contextlib

    from joblib.externals.loky import get_reusable_executor

    from sim.sweep import Planned, load_spec, run_sweep
    from sim.sweep.cluster import cluster_pool

    def sweep(count: int, part: str, pool=None) -> None:
        spec = folder / f"{part}.toml"
        spec.write_text(SPEC.format(runs=count, block=max(1, min(BLOCK, count // 8))))
        design = Planned(load_spec(spec))
        table = run_sweep(
            design, folder / part, workers=workers, block_runs=design.spec.settings.block_runs, pool=pool
        ).table
        assert table.height == count and table["completed"].all()

    with contextlib.ExitStack() as stack:
        pool = stack.enter_context(cluster_pool(None, workers)) if dask else None
        sweep(2 * workers, f"warm-{workers}-{dask}", pool)
        begin = time.perf_counter()
        sweep(runs, f"all-{workers}-{dask}", pool)
        wall = time.perf_counter() - begin
    if workers > 1 and not dask:
        get_reusable_executor().shutdown(wait=True)
    return wall, children_s()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=1000, help="runs of the sweep")
    parser.add_argument("--workers", type=int, default=2, help="processes side by side")
    parser.add_argument("--dask", action="store_true", help="fly on a local Dask cluster as well")
    options = parser.parse_args()
    before = children_s()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        wall_one, cpu_one = fly(options.runs, 1, folder)
        wall_many, cpu_many = fly(options.runs, options.workers, folder)
        result = {
            "runs": options.runs,
            "workers": options.workers,
            "load": os.getloadavg()[0],
            "wall_s": {"one": wall_one, "many": wall_many},
            "wall_ratio": wall_one / wall_many,
            "cpu_ratio": (cpu_one - before) / (cpu_many - cpu_one),
            "cpu_per_run_s": (cpu_one - before) / (options.runs + 2),
        }
        if options.dask:
            wall_dask, _ = fly(options.runs, options.workers, folder, dask=True)
            result |= {"dask_wall_s": wall_dask, "dask_wall_ratio": wall_one / wall_dask}
    print(json.dumps(result))


if __name__ == "__main__":
    main()
