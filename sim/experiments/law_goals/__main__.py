"""``python -m sim.experiments.law_goals --jobs 2``: fly the missing flights, print every goal with figure and n.

``before.csv`` holds the figures of the QP of revision 1262c78, whose rows lack the rotors, same scenes, same seeds.
Exits 1 when a goal is missed. ``--part 0`` only prints, with ``--markdown`` the table of
docs/experiments/comparisons.md.
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
from sim.experiments.part_of_flights import add_part_options, fly_part, parse_part
from sim.experiments.spec import Experiment

HERE = Path(__file__).parent


def main() -> int:
    """Fly, print, and return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m sim.experiments.law_goals", description=__doc__)
    parser.add_argument("--kinds", nargs="+", help="fly only these kinds of flights")
    parser.add_argument("--markdown", action="store_true", help="print a Markdown table")
    add_part_options(parser, "runs/law_goals")
    given = parse_part(parser)
    runs = design(load_toml(Experiment, HERE / "flights.toml"), Choice(features="geometric", compiled=True))
    chosen = [run for run in runs if not given.kinds or run.params["kind"] in given.kinds]
    table, interrupted = fly_part(runs, chosen, given, "goals of the law")
    before = pl.read_csv(HERE / "before.csv")
    goals = load_toml(Goals, HERE / "goals.toml").goals
    planned = Counter((run.params["kind"], run.params["world"]) for run in runs)
    found = [outcome(goal, table, before, planned[goal.kind, goal.world]) for goal in goals]
    headings = ("figure", "before", "now", "ratio, paired", "goal", "n", "met")
    if given.markdown:
        rows = [headings, ("---",) * len(headings), *(each.cells for each in found)]
        print("\n".join("| " + " | ".join(cells) + " |" for cells in rows))
    else:
        Console().print(terminal_table(headings, [each.cells for each in found], text=("figure", "goal")))
    return 130 if interrupted else int(not all(each.met for each in found))


if __name__ == "__main__":
    sys.exit(main())
