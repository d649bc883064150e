"""``python -m sim.experiments.fair TABLE`` prints the page of the record from its template.

Words are those of ``page.md.jinja``; every number in it is a field of `Fields`, computed from the table.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from sim.evaluate.figures import figure_of
from sim.experiments.fair.comparison import OWN, comparisons, grouped, opponent_name
from sim.experiments.opponent import Comparison, Outcome
from sim.experiments.variants import VARIANTS
from sim.sweep.mixed import Ratio, law_and_gains
from sim.sweep.paired import exact_interval
from sim.sweep.statistics import parameters, select, split
from sim.sweep.tables import read_tables

TEMPLATE = Path(__file__).with_name("page.md.jinja")


class Fields:
    """Numbers of the page.

    Args:
        table: Flights of the experiment.
    """

    #: Figures of the mixed model: those of jobs that paint or slide.
    MODELLED = ("path_rms_m", "force_rms_n", "tilt_peak_deg", "yaw_peak_deg")

    def __init__(self, table: pl.DataFrame) -> None:
        self.table, self._found = table, comparisons(table)
        self._groups = grouped(self._found)

    @property
    def cells(self) -> list[dict[str, Any]]:
        """Parameters of every cell, in the order of the table."""
        return [parameters(key) for key, _ in split(self.table, ("experiment",))]

    @property
    def laws(self) -> list[tuple[str, str]]:
        """Law and variant of the QP as shipped, then of every opponent."""
        flown = set(self.table.select("law", "variant").unique().rows())
        return [OWN[0], *sorted(flown - set(OWN))]

    def name(self, law: str, variant: str) -> str:
        """Name of a law with its variant."""
        return opponent_name(law, variant)

    def words(self, variant: str) -> str:
        """Description of a variant."""
        return VARIANTS[variant].words

    def median(self, metric: str, law: str, variant: str = "standard", **cell: Any) -> str:
        """Median of a figure over the flights that ended as planned, with its unit."""
        figure, rows = figure_of(metric), self._rows(law, variant, cell).filter(pl.col("completed"))
        values = rows[metric].drop_nulls().to_numpy()
        return f"{figure.scale * np.median(values):.3g} {figure.unit}".rstrip() if len(values) else "–"

    def gap(self, metric: str, law: str, variant: str = "standard", **cell: Any) -> str:
        """Figure of an opponent minus that of the QP, paired, with its exact interval."""
        figure = figure_of(metric)
        both = self._rows(*OWN[0], cell).join(self._rows(law, variant, cell), on="seed", suffix=".second")
        both = both.filter(pl.col("completed") & pl.col("completed.second"))
        values = figure.scale * (both[f"{metric}.second"] - both[metric]).drop_nulls().to_numpy()
        low, high = exact_interval(values)
        return f"{np.median(values):+.3g} ({low:+.3g} to {high:+.3g}) {figure.unit}".rstrip()

    def done(self, law: str, variant: str, cell: dict[str, Any]) -> str:
        """Flights that ended as planned, of all."""
        rows = self._rows(law, variant, cell)
        return f"{rows['completed'].sum()} of {rows.height}"

    def held(self, law: str, variant: str, cell: dict[str, Any]) -> str:
        """Slides held, of all flights; empty for a cell that does not slide."""
        rows = self._rows(law, variant, cell)
        slides = rows["slide_held"].drop_nulls() if "slide_held" in rows.columns else []
        return f", held {int(sum(slides))} of {rows.height}" if len(slides) else ""

    def count(self, name: str, *outcomes: str) -> int:
        """Groups of figures against an opponent that have exactly these outcomes (names of `Outcome`)."""
        sought = {Outcome[each] for each in outcomes}
        return sum(1 for key, value in self._groups.items() if key[0] == name and value == sought)

    @property
    def lost(self) -> list[Comparison]:
        """Figures in which the QP is worse, in the order of the cells."""
        return [each for each in self._found if each.outcome is Outcome.LOST]

    def mixed(self, metric: str) -> dict[str, Ratio]:
        """Effects of law and gains by the mixed model."""
        return dict(law_and_gains(self.table, metric))

    def figure(self, metric: str) -> str:
        """Name of a figure."""
        return figure_of(metric).label

    def cell_text(self, params: dict[str, Any]) -> str:
        """A cell in words."""
        return f"{params['kind']} {params['level']:g}, {params['world']}"

    def _rows(self, law: str, variant: str, cell: dict[str, Any]) -> pl.DataFrame:
        return select(self.table, cell, law=law, variant=variant)


def page(table: pl.DataFrame) -> str:
    """Text of the page."""
    from jinja2 import Environment, StrictUndefined

    environment = Environment(undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True, autoescape=False)  # nosec
    return environment.from_string(TEMPLATE.read_text(encoding="utf-8")).render(f=Fields(table))


if __name__ == "__main__":
    print(page(read_tables([Path(sys.argv[1])])), end="")
