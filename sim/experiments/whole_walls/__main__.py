"""``python -m sim.experiments.whole_walls datasheet --part 1 --of 4 --out runs/walls``: fly a part, print the figures.

Every part with the same folder adds its flights; flights in it that the code of today made are not flown again. Prints
the flights that failed, then every figure with goal and n over all flights in the folder; exits 1 when one is missed.
"""

from __future__ import annotations

import argparse
import sys

from rich.console import Console

from sim.evaluate.table import terminal_table
from sim.experiments.part_of_flights import add_part_options, fly_part, parse_part
from sim.experiments.whole_walls.figures import failures, lines
from sim.experiments.whole_walls.flights import SETS, runs_of


def main() -> int:
    """Fly, print, and return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m sim.experiments.whole_walls", description=__doc__)
    parser.add_argument("sets", nargs="*", default=SETS, help=f"of {', '.join(SETS)}; default: all")
    parser.add_argument("--laws", nargs="+", choices=("qp", "paper"), default=("qp", "paper"))
    parser.add_argument("--seed", type=int, default=0, help="of the designs: other walls, other faults")
    add_part_options(parser, "runs/whole_walls")
    given = parse_part(parser)
    if unknown := set(given.sets) - set(SETS):
        parser.error(f"unknown set {', '.join(sorted(unknown))}; choose of {', '.join(SETS)}")
    runs = runs_of(given.sets, given.laws, given.seed)
    table, interrupted = fly_part(runs, runs, given, "whole walls")
    console = Console()
    for words in failures(table, given.out):
        console.print(words, markup=False, highlight=False)
    found = lines(table, runs)
    headings = ("figure", "value", "goal", "flights", "met")
    console.print(terminal_table(headings, [line.cells for line in found], text=headings))
    return 130 if interrupted else int(not all(line.met for line in found))


if __name__ == "__main__":
    sys.exit(main())
