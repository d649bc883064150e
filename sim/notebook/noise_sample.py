"""A small noise sweep for notebook 06: every cell of the experiment, short strokes, lines from the sensor model.

Usage: ``python -m sim.notebook.noise_sample`` writes `SAMPLE` anew; after an interruption it continues.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

from sim.evaluate.measures import paint_figures
from sim.experiments.base import Choice, runs
from sim.experiments.noise_sweep import NAME, QUICK_STROKE_M, SIGMA_F, SIGMA_VS
from sim.experiments.scenes import short_job
from sim.sweep import run_sweep
from sim.sweep.design import Run
from sim.sweep.parts import write_table

#: Table that the notebook reads by default.
SAMPLE = Path(__file__).parents[2] / "notebooks" / "data" / "noise_sweep.parquet"
#: Flights per cell and law: the fewest pairs that can make a difference significant (`sim.sweep.paired.needed`).
SEEDS = 6


def sample_runs(seeds: int = SEEDS) -> list[Run]:
    """All nine cells under both laws, without logs."""
    return [
        run
        for vs in SIGMA_VS
        for force in SIGMA_F
        for run in runs(
            NAME,
            Choice(features="geometric"),
            scene=short_job(QUICK_STROKE_M, features={"sigma_vs": vs}, force_torque={"sigma_n": force}),
            measure=paint_figures,
            params={"sigma_vs": vs, "sigma_f_n": force},
            seeds=seeds,
            keep=False,
        )
    ]


def main() -> int:
    """Fly the sample and write its table."""
    folder = Path(tempfile.gettempdir()) / "ibvs-qp-noise-sample"
    result = run_sweep(
        sample_runs(), folder, progress=lambda done, count, _: print(f"{done} of {count} flights", file=sys.stderr)
    )
    if result.interrupted:
        return 130
    write_table(SAMPLE, result.table.drop("log"))
    print(f"{SAMPLE}: {result.table.height} flights")
    return 0


if __name__ == "__main__":
    sys.exit(main())
