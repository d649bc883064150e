"""``python -m sim.experiments.whole_walls datasheet --part 1 --of 4 --out runs/walls``: fly a part, print the figures.

Every part with the same folder adds its flights; flights in it that the code of today made are not flown again. Prints
the flights that failed, then every figure with bound and n over all flights in the folder; exits 1 when one is missed.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from rich.console import Console

from sim.evaluate.table import terminal_table
from sim.experiments.whole_walls.figures import failures, outcomes
from sim.experiments.whole_walls.flights import SETS, runs_of
from sim.sweep import run_sweep
from sim.sweep.design import listed_block
from sim.sweep.parts import part_file, read_tables
from sim.sweep.progress import sweep_progress


def main() -> int:
    """Fly, print, and return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m sim.experiments.whole_walls", description=__doc__)
    parser.add_argument("sets", nargs="*", default=SETS, help=f"of {', '.join(SETS)}; default: all")
    parser.add_argument("--laws", nargs="+", choices=("qp", "paper"), default=("qp", "paper"))
    parser.add_argument("--seed", type=int, default=0, help="of the designs: other walls, other faults")
    parser.add_argument("--part", type=int, default=1, help="part to fly, from 1; 0 only prints the figures")
    parser.add_argument("--of", type=int, default=1, help="number of parts, of about the same flight time")
    parser.add_argument("--jobs", type=int, default=1, help="processes side by side")
    parser.add_argument("--out", type=Path, default=Path("runs/whole_walls"), help="folder that the parts share")
    given = parser.parse_args()
    if not 0 <= given.part <= given.of:
        parser.error(f"--part must be from 0 to {given.of}")
    if unknown := set(given.sets) - set(SETS):
        parser.error(f"unknown set {', '.join(sorted(unknown))}; choose of {', '.join(SETS)}")
    runs = runs_of(given.sets, given.laws, given.seed)
    part = runs[given.part - 1 :: given.of] if given.part else []
    console = Console()
    with sweep_progress(console, "whole walls") as progress:
        result = run_sweep(part, given.out, workers=given.jobs, progress=progress)
    files = [part_file(given.out, listed_block([run]).name) for run in runs]
    table = read_tables(file for file in files if file.exists())
    for words in failures(table, given.out):
        console.print(words, markup=False, highlight=False)
    found = outcomes(table, runs)
    headings = ("figure", "bound", "median", "worst", "flights", "met")
    console.print(terminal_table(headings, [each.cells for each in found], text=headings))
    return 130 if result.interrupted else int(not all(each.met for each in found))


if __name__ == "__main__":
    sys.exit(main())
