"""``python -m sim.experiments.fair TABLE`` prints the page of the record from its template.

Words are those of ``page.md.jinja``; every number in it is a field of `sim.experiments.page.Fields`.
"""

from __future__ import annotations

import sys
from pathlib import Path

import polars as pl

from sim.experiments import FAIR
from sim.experiments.page import Fields, render
from sim.experiments.spec import experiment
from sim.sweep.tables import read_tables

TEMPLATE = Path(__file__).with_name("page.md.jinja")


def page(table: pl.DataFrame) -> str:
    """Text of the page of the experiment ``fair``."""
    return render(TEMPLATE, f=Fields(experiment(FAIR), table))


if __name__ == "__main__":
    print(page(read_tables([Path(sys.argv[1])])), end="")
