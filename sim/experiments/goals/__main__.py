"""``python -m sim.experiments.goals SET --jobs 2``: fly the missing flights, print every goal with figure and n.

A set is a folder here: ``flights.toml`` and ``goals.toml``. ``law/before.csv`` holds the figures of the QP of revision
1262c78, whose rows lack the rotors, same scenes, same seeds. Exits 1 when a goal is missed. ``--part 0`` only prints,
with ``--markdown`` a table as those of docs/experiments/comparisons.md.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import polars as pl
from rich.console import Console

from ibvs_qp.config.settings import load_toml
from sim.evaluate.table import terminal_table
from sim.experiments.design import Choice, design
from sim.experiments.goals.goal import Goals, flights_of, outcome
from sim.experiments.part_of_flights import add_part_options, fly_part, parse_part
from sim.experiments.spec import Experiment

HERE = Path(__file__).parent
#: Sets of flights with goals.
SETS = sorted(file.parent.name for file in HERE.glob("*/goals.toml"))


def main() -> int:
    """Fly, print, and return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m sim.experiments.goals", description=__doc__)
    parser.add_argument("set", choices=SETS, help="set of flights")
    parser.add_argument("--kinds", nargs="+", help="fly only these kinds of flights")
    parser.add_argument("--markdown", action="store_true", help="print a Markdown table")
    add_part_options(parser, "runs/goals")
    given = parse_part(parser)
    folder = HERE / given.set
    runs = design(load_toml(Experiment, folder / "flights.toml"), Choice(features="geometric", compiled=True))
    chosen = [run for run in runs if not given.kinds or run.params["kind"] in given.kinds]
    table, interrupted = fly_part(runs, chosen, given, f"goals: {given.set}")
    before = pl.read_csv(folder / "before.csv") if (folder / "before.csv").exists() else None
    found = [
        outcome(goal, table, before, len(flights_of(goal, runs)))
        for goal in load_toml(Goals, folder / "goals.toml").goals
    ]
    headings = ("figure", "reference", "now", "ratio, paired", "goal", "n", "met")
    if given.markdown:
        rows = [headings, ("---",) * len(headings), *(each.cells for each in found)]
        print("\n".join("| " + " | ".join(cells) + " |" for cells in rows))
    else:
        Console().print(terminal_table(headings, [each.cells for each in found], text=("figure", "goal")))
    return 130 if interrupted else int(not all(each.met for each in found))


if __name__ == "__main__":
    sys.exit(main())
