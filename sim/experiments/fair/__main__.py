"""``python -m sim.experiments.fair TABLE`` prints the page of the record from its template.

Words are those of ``page.md.jinja``; every number in it is a field of `Fields`, computed from the table.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from sim.evaluate.figures import figure_of
from sim.experiments import FAIR
from sim.experiments.fair.comparison import GROUPS, OWN, Comparison, Outcome, comparisons, grouped
from sim.experiments.spec import experiment
from sim.experiments.variants import VARIANTS
from sim.flight.trace import law_name
from sim.sweep.mixed import Ratio, law_and_gains
from sim.sweep.paired import exact_interval
from sim.sweep.statistics import parameters, select, split
from sim.sweep.tables import read_tables

TEMPLATE = Path(__file__).with_name("page.md.jinja")
#: Laws and variants of the analytic law with its own rows, of which the best of a cell counts.
ANALYTIC = (("paper", "standard"), ("paper", "shared-gains"), ("paper", "box"))
#: Figures of the mixed model: those of jobs that paint or slide.
MODELLED = ("path_rms_m", "force_rms_n", "tilt_peak_deg", "yaw_peak_deg")


class Fields:
    """Numbers of the page.

    Args:
        table: Flights of the experiment.
    """

    def __init__(self, table: pl.DataFrame) -> None:
        self.table = table
        self.found = comparisons(table)
        self._groups = grouped(self.found)

    @property
    def cells(self) -> list[dict[str, Any]]:
        """Parameters of every cell, in the order of the table."""
        return [parameters(key) for key, _ in split(self.table, ("experiment",))]

    @property
    def opponents(self) -> list[tuple[str, str]]:
        """Law and variant of every opponent."""
        return sorted({each.opponent for each in self.found})

    def name(self, opponent: tuple[str, str]) -> str:
        """Name of a law with its variant."""
        law, variant = opponent
        return {"mpc": "prediction over 0.3 s", "standard": law_name(law)}.get(variant, f"{law_name(law)}, {variant}")

    def words(self, opponent: tuple[str, str]) -> str:
        """Description of its variant."""
        return VARIANTS[opponent[1]].words

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

    def done(self, law: str, variant: str = "standard", **cell: Any) -> str:
        """Flights that ended as planned, of all."""
        rows = self._rows(law, variant, cell)
        return f"{rows['completed'].sum()} of {rows.height}"

    def share(self, metric: str, law: str, variant: str = "standard", **cell: Any) -> str:
        """Flights in which a flag is set, of all."""
        rows = self._rows(law, variant, cell)
        return f"{int(rows[metric].fill_null(0.0).sum())} of {rows.height}"

    def count(self, outcome: str, opponent: tuple[str, str], kinds: Sequence[str] = ()) -> int:
        """Groups of figures with an outcome (a name of `Outcome`) against an opponent, of cells of those kinds."""
        sought = Outcome[outcome]
        keys = (key for key, value in self._groups.items() if value is sought and key[0] == opponent)
        return sum(1 for _, cell, _ in keys if not kinds or any(f"'kind': '{kind}'" in cell for kind in kinds))

    def single(self, outcome: str) -> list[Comparison]:
        """Figures with an outcome, in the order of the cells."""
        return [each for each in self.found if each.outcome is Outcome[outcome]]

    def lost_groups(self) -> Counter[str]:
        """Lost groups of figures by group, over all opponents."""
        return Counter(group for (_, _, group), value in self._groups.items() if value is Outcome.LOST)

    def mixed(self, metric: str) -> dict[str, Ratio]:
        """Effects of law and gains by the mixed model."""
        return dict(law_and_gains(self.table, metric))

    def figure(self, metric: str) -> str:
        """Name of a figure."""
        return figure_of(metric).label

    @staticmethod
    def cell_text(params: dict[str, Any]) -> str:
        """A cell in words."""
        return f"{params['kind']} {params['level']:g}, {params['world']}"

    def _rows(self, law: str, variant: str, cell: dict[str, Any]) -> pl.DataFrame:
        return select(self.table, cell, law=law, variant=variant)


def page(table: pl.DataFrame) -> str:
    """Text of the page."""
    from jinja2 import Environment, StrictUndefined

    environment = Environment(undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True, autoescape=False)  # nosec
    template = environment.from_string(TEMPLATE.read_text(encoding="utf-8"))
    fields = Fields(table)
    return template.render(
        f=fields,
        spec=experiment(FAIR),
        GROUPS=GROUPS,
        MODELLED=MODELLED,
        ANALYTIC=ANALYTIC,
        flights=table.height,
        Outcome=Outcome,
    )


if __name__ == "__main__":
    print(page(read_tables([Path(sys.argv[1])])), end="")
