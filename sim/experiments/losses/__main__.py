"""``python -m sim.experiments.losses --part 1 --of 4 --jobs 2``: fly a part, print where the QP loses and wins.

A comparison is one figure of one cell against one opponent: the analytic law with its own gains or those of the QP, and
where limits act also with another allocator, and the predictive rival. It is lost when the whole exact interval of the
paired median is worse than the least difference that matters. ``--save FILE`` keeps the flights as a table, and
``--table FILE`` prints from one. Exits 1 when more than three are lost, flights are missing, or a flight ended with an
error. ``--times`` flies a slide under every law and prints how long its steps take, which no table keeps.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from pathlib import Path

import numpy as np
import polars as pl
from rich.console import Console

from sim.evaluate.table import terminal_table
from sim.experiments.comparison import Outcome
from sim.experiments.losses.comparison import comparisons
from sim.experiments.losses.flights import COMPARED, runs_of
from sim.experiments.part_of_flights import add_part_options, fly_part, parse_part
from sim.flight.closed_loop import fly
from sim.sweep.tables import read_tables

#: Comparisons that the QP may lose.
MOST_LOST = 3


def main() -> int:
    """Fly, print, and return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m sim.experiments.losses", description=__doc__)
    parser.add_argument("experiments", nargs="*", default=COMPARED, help=f"of {', '.join(COMPARED)}; default: all")
    parser.add_argument("--table", type=Path, help="print from this table; nothing flies")
    parser.add_argument("--save", type=Path, help="keep all flights in this table")
    parser.add_argument("--times", action="store_true", help="print how long a step of each law takes instead")
    add_part_options(parser, "runs/losses")
    given = parse_part(parser)
    console = Console()
    if given.times:
        console.print(terminal_table(("law", "variant", "step, median, µs"), step_times(), text=("law", "variant")))
        return 0
    if unknown := set(given.experiments) - set(COMPARED):
        parser.error(f"unknown experiment {', '.join(sorted(unknown))}; choose of {', '.join(COMPARED)}")
    runs = runs_of(tuple(dict.fromkeys(given.experiments)))
    flown, interrupted = fly_part(runs, runs, given, "losses") if given.table is None else (_read(given), False)
    if given.save:
        flown.write_parquet(given.save, compression="zstd")
    broken = pl.col("reason").str.contains("^(error|refused): ")
    found = comparisons(flown.filter(~broken))
    headings = ("experiment", "cell", "opponent", "figure", "QP worse by", "matters", "n")
    lost = [each for each in found if each.outcome is Outcome.LOST]
    console.print(terminal_table(headings, [each.cells for each in lost], text=headings[:4]))
    counts = Counter((each.opponent, each.outcome) for each in found)
    rows = [(name, *(str(counts[name, each]) for each in Outcome)) for name in sorted({name for name, _ in counts})]
    console.print(terminal_table(("opponent", *(each.value for each in Outcome)), rows, text=("opponent",)))
    errors = flown.filter(broken)
    for row in errors.to_dicts():
        words = f"{row['experiment']}, {row['law']}, {row['variant']}, seed {row['seed']}: {row['reason']}"
        console.print(words, markup=False, highlight=False)
    console.print(
        f"{len(lost)} of {len(found)} comparisons lost, goal: at most {MOST_LOST}; {len(flown)} of {len(runs)} flights"
    )
    if interrupted:
        return 130
    return int(len(lost) > MOST_LOST or len(flown) < len(runs) or len(errors) > 0)


def _read(given: argparse.Namespace) -> pl.DataFrame:
    """Flights of the table, of the experiments."""
    return read_tables([given.table], ("experiment",)).filter(pl.col("experiment").is_in(given.experiments))


def step_times() -> list[tuple[str, ...]]:
    """Law, variant and median duration of its steps in the first slide of the rivals [µs]."""
    slides = {(run.law, run.variant): run for run in reversed(runs_of(("rivals",))) if run.params["kind"] == "slide"}
    times = []
    for (law, variant), run in sorted(slides.items()):
        trace = fly(run.plan.scene, run.plan.options, job=run.plan.job, config=run.plan.config)
        times.append((law, variant, f"{np.median(trace.step_us):.0f}"))
    return times


if __name__ == "__main__":
    sys.exit(main())
