"""``python -m sim.experiments.fair TABLE`` prints the page of the record; ``TABLE README.md`` renews its summary there.

Words are those of ``page.md.jinja`` and ``summary.md.jinja``; every number in them is a field of
`sim.experiments.page.Fields`.
"""

from __future__ import annotations

import sys
from pathlib import Path

import polars as pl

from sim.experiments import FAIR
from sim.experiments.page import Fields, render
from sim.experiments.spec import experiment
from sim.sweep.parts import read_tables

TEMPLATE, SUMMARY = (Path(__file__).with_name(f"{name}.md.jinja") for name in ("page", "summary"))
#: Marks of the summary in the README.
BEGIN, END = "<!-- results: generated -->", "<!-- end of results -->"


def page(table: pl.DataFrame) -> str:
    """Text of the page of the experiment ``fair``."""
    return render(TEMPLATE, f=Fields(experiment(FAIR), table), summary=summary(table))


def summary(table: pl.DataFrame) -> str:
    """Its verdict in a few lines."""
    return render(SUMMARY, f=Fields(experiment(FAIR), table))


def put_into(text: str, table: pl.DataFrame) -> str:
    """A text with a new summary between its marks.

    Raises:
        ValueError: When the marks are missing.
    """
    head, tail = text.index(BEGIN) + len(BEGIN), text.index(END)
    return f"{text[:head]}\n{summary(table)}\n{text[tail:]}"


if __name__ == "__main__":
    flown = read_tables([Path(sys.argv[1])])
    if len(sys.argv) == 2:
        print(page(flown), end="")
    else:
        readme = Path(sys.argv[2])
        readme.write_text(put_into(readme.read_text(encoding="utf-8"), flown), encoding="utf-8")
