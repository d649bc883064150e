"""``python -m sim.experiments.law_goals --jobs 2``: fly what is missing, print every goal with figure and n.

``before.csv`` holds the figures of the QP of revision 1262c78, whose rows lack the rotors, same scenes, same seeds.
Exits 1 when a goal is missed. ``--part 0`` only prints.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from pathlib import Path

import polars as pl
from rich.console import Console

from ibvs_qp.config.settings import load_toml
from sim.evaluate.table import terminal_table
from sim.experiments.design import Choice, design
from sim.experiments.law_goals.goal import Goals, outcome
from sim.experiments.spec import Experiment
from sim.sweep import run_sweep
from sim.sweep.fingerprint import listed_block
from sim.sweep.parts import part_file
from sim.sweep.progress import sweep_progress
from sim.sweep.tables import read_tables

HERE = Path(__file__).parent


def main() -> int:
    """Fly, print, and return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m sim.experiments.law_goals", description=__doc__)
    parser.add_argument("--kinds", nargs="+", help="fly only these kinds of flights")
    parser.add_argument("--part", type=int, default=1, help="part to fly, from 1; 0 only prints the figures")
    parser.add_argument("--of", type=int, default=1, help="number of parts")
    parser.add_argument("--jobs", type=int, default=1, help="processes side by side")
    parser.add_argument("--out", type=Path, default=Path("runs/law_goals"), help="folder that the parts share")
    given = parser.parse_args()
    if not 0 <= given.part <= given.of:
        parser.error(f"--part must be from 0 to {given.of}")
    runs = design(load_toml(Experiment, HERE / "flights.toml"), Choice(features="geometric"))
    wanted = [run for run in runs if not given.kinds or run.params["kind"] in given.kinds]
    part = wanted[given.part - 1 :: given.of] if given.part else []
    console = Console()
    with sweep_progress(console, "goals of the law") as progress:
        result = run_sweep(part, given.out, workers=given.jobs, progress=progress)
    files = [part_file(given.out, listed_block([run]).name) for run in runs]
    table = read_tables(file for file in files if file.exists())
    before = pl.read_csv(HERE / "before.csv")
    goals = load_toml(Goals, HERE / "goals.toml").goals
    planned = Counter((run.params["kind"], run.params["world"]) for run in runs)
    found = [outcome(goal, table, before, planned[goal.kind, goal.world]) for goal in goals]
    headings = ("figure", "before", "now", "ratio, paired", "goal", "n", "met")
    console.print(terminal_table(headings, [each.cells for each in found], text=("figure", "goal")))
    return 130 if result.interrupted else int(not all(each.met for each in found))


if __name__ == "__main__":
    sys.exit(main())
