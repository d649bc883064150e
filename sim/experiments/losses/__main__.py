"""``python -m sim.experiments.losses --part 1 --of 4 --jobs 2``: fly a part, print where the QP loses and wins.

A comparison is one figure of one cell against one opponent: the analytic law with its own gains or those of the QP, and
where limits act also with another allocator, and the predictive rival. It is lost when the whole exact interval of the
paired median is worse than the least difference that matters. Exits 1 when more than three are lost, flights are
missing, or a flight ended with an error.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter

import polars as pl
from rich.console import Console

from sim.evaluate.table import terminal_table
from sim.experiments.losses.comparison import Outcome, comparisons
from sim.experiments.losses.flights import COMPARED, runs_of
from sim.experiments.part_of_flights import add_part_options, fly_part, parse_part

#: Comparisons that the QP may lose.
MOST_LOST = 3


def main() -> int:
    """Fly, print, and return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m sim.experiments.losses", description=__doc__)
    parser.add_argument("experiments", nargs="*", default=COMPARED, help=f"of {', '.join(COMPARED)}; default: all")
    add_part_options(parser, "runs/losses")
    given = parse_part(parser)
    if unknown := set(given.experiments) - set(COMPARED):
        parser.error(f"unknown experiment {', '.join(sorted(unknown))}; choose of {', '.join(COMPARED)}")
    runs = runs_of(tuple(dict.fromkeys(given.experiments)))
    flown, interrupted = fly_part(runs, runs, given, "losses")
    broken = pl.col("reason").str.contains("^(error|refused): ")
    console, found = Console(), comparisons(flown.filter(~broken))
    headings = ("experiment", "cell", "opponent", "figure", "QP worse by", "matters", "n")
    lost = [each for each in found if each.outcome is Outcome.LOST]
    console.print(terminal_table(headings, [each.cells for each in lost], text=headings[:4]))
    counts = Counter((each.opponent, each.outcome) for each in found)
    rows = [(name, *(str(counts[name, each]) for each in Outcome)) for name in sorted({name for name, _ in counts})]
    console.print(terminal_table(("opponent", *(each.value for each in Outcome)), rows, text=("opponent",)))
    console.print(terminal_table(("law", "variant", "step, median, µs"), _times(flown), text=("law", "variant")))
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


def _times(flown: pl.DataFrame) -> list[tuple[str, ...]]:
    """Law, variant and median time of their steps [µs]."""
    if flown.is_empty():
        return []
    times = flown.group_by("law", "variant").agg(pl.col("step_us.p50").median()).sort("law", "variant")
    return [(law, variant, f"{time:.0f}") for law, variant, time in times.rows()]


if __name__ == "__main__":
    sys.exit(main())
