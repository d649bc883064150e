"""The results page of flown experiments from its template; every number is a field of `Fields`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from sim.evaluate.figures import figure_of
from sim.evaluate.table import markdown
from sim.experiments.comparison import Comparison, Outcome, comparisons, grouped, opponent_name
from sim.experiments.spec import Experiment
from sim.experiments.variants import VARIANTS
from sim.experiments.verdict import Verdict, cell, entry, headings, interval, measured, value_of, verdicts
from sim.flight.trace import law_name
from sim.sweep.statistics import (
    Ratio,
    cells,
    exact_interval,
    false_claims,
    law_and_gains,
    needed,
    parameters,
    select,
    split,
)

TEMPLATE = Path(__file__).with_name("page.md.jinja")
#: The QP as shipped.
QP = ("qp", "standard")


class Fields:
    """Numbers and tables of one experiment.

    Args:
        experiment: The experiment.
        table: Its flights.
        figures: Caption and file of each figure; files are relative to the page.
    """

    #: Figures of the mixed model: those of jobs that paint or slide.
    MODELLED = ("path_rms_m", "force_rms_n", "tilt_peak_deg", "yaw_peak_deg")

    def __init__(
        self, experiment: Experiment, table: pl.DataFrame, figures: Mapping[str, tuple[str, Path]] | None = None
    ) -> None:
        self.experiment, self.table, self.figures = experiment, table, dict(figures or {})
        self._found = comparisons(experiment, table)
        self._groups = grouped(self._found)

    @property
    def cells(self) -> list[dict[str, Any]]:
        """Parameters of every cell, in the order of the table."""
        return [parameters(key) for key, _ in split(self.table, ("experiment",))]

    @property
    def laws(self) -> list[tuple[str, str]]:
        """Law and variant of every opponent of the QP: laws in its place, not parts or gains of its own."""
        flown = sorted(self.table.select("law", "variant").unique().rows())
        return [(law, variant) for law, variant in flown if law != "qp" or VARIANTS[variant].controller]

    @property
    def opponents(self) -> list[str]:
        """Names of everything that was compared."""
        return list(dict.fromkeys(each.opponent for each in self._found))

    @property
    def variants(self) -> dict[str, str]:
        """Variants flown, with their descriptions."""
        flown = set(self.table["variant"].unique())
        return {name: variant.words for name, variant in VARIANTS.items() if name in flown}

    @property
    def lost(self) -> list[Comparison]:
        """Figures in which the QP is worse than a law in its place, in the order of the cells."""
        names = {opponent_name(*each) for each in self.laws}
        return [each for each in self._found if each.outcome is Outcome.LOST and each.opponent in names]

    @property
    def decided(self) -> list[Comparison]:
        """Figures in which the QP is better or worse."""
        return [each for each in self._found if each.outcome in (Outcome.WON, Outcome.LOST)]

    def name(self, law: str, variant: str) -> str:
        """Name of a law with its variant."""
        return opponent_name(law, variant)

    def count(self, name: str, *outcomes: str) -> int:
        """Groups of figures against an opponent that have exactly these outcomes (names of `Outcome`)."""
        sought = {Outcome[each] for each in outcomes}
        return sum(1 for key, value in self._groups.items() if key[0] == name and value == sought)

    def figure(self, metric: str) -> str:
        """Name of a figure."""
        return figure_of(metric).label

    def median(self, metric: str, law: str, variant: str = "standard", **params: Any) -> str:
        """Median of a figure over the flights that ended as planned, with its unit."""
        figure, rows = figure_of(metric), self._rows(law, variant, params).filter(pl.col("completed"))
        values = rows[metric].drop_nulls().to_numpy() if metric in rows.columns else ()
        return f"{figure.scale * np.median(values):.3g} {figure.unit}".rstrip() if len(values) else "–"

    def gap(self, metric: str, law: str, variant: str = "standard", **params: Any) -> str:
        """Figure of an opponent minus that of the QP, paired, with its exact interval."""
        figure = figure_of(metric)
        if metric not in self.table.columns:
            return "–"
        both = self._rows(*QP, params).join(self._rows(law, variant, params), on="seed", suffix=".second")
        both = both.filter(pl.col("completed") & pl.col("completed.second"))
        values = figure.scale * (both[f"{metric}.second"] - both[metric]).drop_nulls().to_numpy()
        if not len(values):
            return "–"
        low, high = exact_interval(values)
        return f"{np.median(values):+.3g} ({low:+.3g} to {high:+.3g}) {figure.unit}".rstrip()

    def done(self, law: str, variant: str, **params: Any) -> str:
        """Flights that ended as planned, of all."""
        rows = self._rows(law, variant, params)
        return f"{rows['completed'].sum()} of {rows.height}"

    def kept(self, law: str, variant: str, **params: Any) -> int:
        """Slides held."""
        return int(self._rows(law, variant, params)["slide_held"].drop_nulls().sum())

    def held(self, law: str, variant: str, **params: Any) -> str:
        """Slides held, of all flights; empty for a cell that does not slide."""
        rows = self._rows(law, variant, params)
        slides = rows["slide_held"].drop_nulls() if "slide_held" in rows.columns else []
        return f", held {int(sum(slides))} of {rows.height}" if len(slides) else ""

    def mixed(self, metric: str) -> dict[str, Ratio]:
        """Effects of law and gains by the mixed model."""
        return dict(law_and_gains(self.table, metric))

    def cell_text(self, params: Mapping[str, Any]) -> str:
        """A cell in words."""
        return cell(self.experiment, params) or "all"

    def cell_table(self) -> str:
        """Medians with their intervals of every cell that no figure shows in its place."""
        experiment, columns = self.experiment, measured(self.experiment, self.table)
        heads = [*experiment.params.values(), "variant", "law", "done", *headings(columns)]
        rows, folded = [], 0
        for flown in cells(self.table, {column.metric for column in columns if column.of_all}):
            if experiment.is_folded(flown["params"]):
                folded += 1
                continue
            row = [entry(flown["params"].get(name, "")) for name in experiment.params]
            row += [flown["variant"], law_name(flown["law"]), f"{flown['completed']} of {flown['n']}"]
            values = ((value_of(flown["metrics"], column, flown["params"]), column) for column in columns)
            rows.append(
                row + [interval(value, column, flown["counts"].get(column.metric, 0)) for value, column in values]
            )
        more = f"\n{folded} more cells are in the figure and in the table of flights.\n" if folded else ""
        return markdown(heads, rows) + more

    def bound_table(self) -> str:
        """Every bound with the flown figure; empty without bounds."""
        heads = ("figure", "cell", "bound", "median", "worst flight", "flights within", "met")
        found = verdicts(self.experiment, self.table)
        return markdown(heads, [_bound(self.experiment, each) for each in found]) if found else ""

    def failures(self) -> list[str]:
        """Flights that did not end as planned: law, cell, seeds and reason."""
        lines = []
        for key, rows in split(self.table.filter(~pl.col("completed")), ("law", "variant", "reason")):
            seeds, where = ", ".join(map(str, sorted(rows["seed"]))), self.cell_text(parameters(key))
            lines.append(f"{opponent_name(key['law'], key['variant'])}, {where}, seeds {seeds}: {key['reason']}")
        return lines

    def _rows(self, law: str, variant: str, params: Mapping[str, Any]) -> pl.DataFrame:
        return select(self.table, params, law=law, variant=variant)


def _bound(experiment: Experiment, verdict: Verdict) -> list[str]:
    criterion = verdict.criterion
    unit = f" {criterion.unit}" if criterion.unit else ""
    sign = (">=" if criterion.least else "<=") + (" every" if criterion.every and criterion.share == 1.0 else "")
    share = f" in {100.0 * criterion.share:.0f} %" if criterion.every and criterion.share < 1.0 else ""
    where = cell(experiment, verdict.place) or "all"
    where += f", {criterion.variant}" if criterion.variant != "standard" else ""
    where += f", {law_name(criterion.law)}" if criterion.law != "qp" else ""
    values = (f"{value:.3g}{unit}" if np.isfinite(value) else "–" for value in (verdict.median, verdict.worst))
    met = "**no**" if verdict.words == "no" else verdict.words
    bound, within = f"{sign} {verdict.bound:.4g}{unit}{share}", f"{verdict.within} of {verdict.n}"
    return [criterion.text, where, bound, *values, within, met]


def render(template: Path, **values: Any) -> str:
    """Text of a template; a missing value is an error."""
    from jinja2 import Environment, StrictUndefined

    environment = Environment(undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True, autoescape=False)  # nosec
    return environment.from_string(template.read_text(encoding="utf-8")).render(**values)


def results_page(flown: Sequence[Fields], lead: str, command: str) -> str:
    """Markdown text of the page.

    Args:
        flown: The flown experiments.
        lead: A sentence on the flights.
        command: Command that repeats one experiment, with ``{name}`` in the place of its name.
    """
    claims = sum(false_claims(each.table) for each in flown)
    return render(TEMPLATE, flown=flown, lead=lead, command=command, claims=claims, needed=needed())
