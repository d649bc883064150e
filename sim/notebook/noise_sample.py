"""A small noise sweep for notebook 06: every cell of the experiment, short strokes, lines from the sensor model.

Usage: ``python -m sim.notebook.noise_sample`` writes `SAMPLE` anew; after an interruption it continues.
"""

from __future__ import annotations

import dataclasses
import sys
import tempfile
from pathlib import Path

from sim.experiments.design import Choice, design
from sim.experiments.spec import experiment
from sim.sweep import run_sweep
from sim.sweep.design import Run
from sim.sweep.parts import write_table

#: Table that the notebook reads by default.
SAMPLE = Path(__file__).parents[2] / "notebooks" / "data" / "noise_sweep.parquet"
#: Flights per cell and law: the fewest pairs that can make a difference significant (`sim.sweep.statistics.needed`).
SEEDS = 6
#: World of the sample: its two noises are the only errors beyond those of the scene's sensors.
WORLD = "ideal"


def sample_runs(seeds: int = SEEDS) -> list[Run]:
    """All nine cells under both laws, without logs."""
    sweep = experiment("noise-sweep")
    short = dataclasses.replace(sweep.flights[0], seeds=seeds, keep=False, fixed=sweep.quick[0].fixed)
    return design(dataclasses.replace(sweep, flights=(short,)), Choice(features="geometric", world=WORLD))


def main() -> int:
    """Fly the sample and write its table."""
    folder = Path(tempfile.gettempdir()) / "ibvs-qp-noise-sample"
    result = run_sweep(
        sample_runs(), folder, progress=lambda done, count, *_: print(f"{done} of {count} flights", file=sys.stderr)
    )
    if result.interrupted:
        return 130
    write_table(SAMPLE, result.table.drop("log"))
    print(f"{SAMPLE}: {result.table.height} flights")
    return 0


if __name__ == "__main__":
    sys.exit(main())
