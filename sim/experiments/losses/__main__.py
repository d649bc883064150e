"""``python -m sim.experiments.losses --part 1 --of 4 --jobs 2``: fly a part, print where the QP loses and wins.

A comparison is one figure of one cell against one opponent: the analytic law with its own gains or those of the QP,
with clipping or another allocator, and the predictive rival. It is lost when the exact interval of the paired median is
worse than the least difference that matters as a whole. Exits 1 when more than three are lost, or flights are missing.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter

from rich.console import Console

from sim.evaluate.table import terminal_table
from sim.experiments.losses.comparison import comparisons
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
    runs = runs_of(tuple(given.experiments))
    table, interrupted = fly_part(runs, runs, given, "losses")
    console, found = Console(), comparisons(table)
    headings = ("experiment", "cell", "opponent", "figure", "QP worse by", "matters", "n")
    lost = [each for each in found if each.lost]
    console.print(terminal_table(headings, [each.cells for each in lost], text=headings[:4]))
    counts = Counter((each.opponent, "lost" if each.lost else "won" if each.won else "neither") for each in found)
    rows = [
        (name, *(str(counts[name, outcome]) for outcome in ("lost", "won", "neither")))
        for name in sorted({each.opponent for each in found})
    ]
    console.print(terminal_table(("opponent", "QP lost", "QP won", "neither"), rows, text=("opponent",)))
    console.print(
        f"{len(lost)} of {len(found)} comparisons lost, goal: at most {MOST_LOST}; {len(table)} of {len(runs)} flights"
    )
    if interrupted:
        return 130
    return int(len(lost) > MOST_LOST or len(table) < len(runs))


if __name__ == "__main__":
    sys.exit(main())
