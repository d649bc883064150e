"""One experiment as data: what is flown, which figures the tables show, and the criteria of the QP law.

Each experiment is one file ``specs/NAME.toml``. Unknown keys and wrong types are errors.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ibvs_qp.config.errors import ConfigError
from ibvs_qp.config.settings import choice, load_toml, setting, validate
from sim.sweep.design import Parameter

SPECS = Path(__file__).with_name("specs")
#: Value of a dotted path of scene, pilot or job; integers stay integers.
Value = int | float | bool | str | tuple[float, ...]
#: What is measured on a flight; a paint flight paints, the others press.
MEASURES = ("paint", "press", "slide", "loss")
#: Statistic that a bound applies to: the median of the cell, or each of its flights (flags, peaks, counts of mishaps).
MEDIAN, EVERY = "median", "every flight"


@dataclass(frozen=True, kw_only=True)
class Column:
    """A metric shown in the tables of an experiment.

    Attributes:
        metric: Column of the table of flights.
        label: Heading.
        unit: Unit shown.
        scale: Factor from SI to `unit`.
        digits: Decimals.
        better: +1 if more is better, -1 if less is better, 0 if neither.
        of_all: Whether flights that did not end as planned have the metric too.
        where: Cells with this metric, by parameter; empty means all.
    """

    metric: str
    label: str
    unit: str = ""
    scale: float = 1.0
    digits: int = 2
    better: int = -1
    of_all: bool = False
    where: dict[str, Parameter] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class Bound:
    """A bound on one metric of the QP law.

    Attributes:
        text: Label; ``{name:g}`` inserts a parameter of the cell.
        metric: Column of the table of flights.
        at_most: Upper bound, in SI; exactly one of `at_most` and `at_least` is given.
        at_least: Lower bound, in SI.
        scale: Factor from SI to `unit`.
        unit: Unit shown.
        statistic: `MEDIAN` or `EVERY`.
        include_failed: Whether flights that did not end as planned count with their values.
        reason: Why this bound.
    """

    text: str
    metric: str
    at_most: float = math.nan
    at_least: float = math.nan
    scale: float = 1.0
    unit: str = ""
    statistic: str = choice(MEDIAN, "statistic that the bound applies to", (MEDIAN, EVERY))
    include_failed: bool = False
    reason: str = ""

    def __post_init__(self) -> None:
        """Validate."""
        validate(self)
        if math.isnan(self.at_most) == math.isnan(self.at_least):
            raise ConfigError(f"bound {self.text!r} needs either at_most or at_least")

    @property
    def least(self) -> bool:
        """Whether the bound is a lower one."""
        return math.isnan(self.at_most)

    @property
    def bound(self) -> float:
        """The bound, in SI."""
        return self.at_least if self.least else self.at_most

    @property
    def every(self) -> bool:
        """Whether each flight must satisfy the bound."""
        return self.statistic == EVERY


@dataclass(frozen=True, kw_only=True)
class Criterion(Bound):
    """A bound with the variant and the cells it applies to; empty `where` means all cells."""

    variant: str = "standard"
    where: dict[str, Parameter] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class Criteria:
    """Bounds that apply to the same cells: every variant, then every cell, then every bound.

    Attributes:
        bounds: The bounds.
        where: Parameters that all cells share.
        cells: Further parameters of each cell.
        variants: Variants.
    """

    bounds: tuple[Bound, ...]
    where: dict[str, Parameter] = field(default_factory=dict)
    cells: tuple[dict[str, Parameter], ...] = ({},)
    variants: tuple[str, ...] = ("standard",)

    def expanded(self) -> Iterator[Criterion]:
        """One criterion per variant, cell and bound."""
        for variant in self.variants:
            for cell in self.cells:
                where = self.where | cell
                for bound in self.bounds:
                    values = {each.name: getattr(bound, each.name) for each in dataclasses.fields(bound)}
                    values["text"] = bound.text.format(**where)
                    yield Criterion(**values, variant=variant, where=where)


@dataclass(frozen=True, kw_only=True)
class Flights:
    """Flights of one kind: every combination of the levels, under each law with the same seeds.

    Attributes:
        measure: What is measured; see `MEASURES`.
        seeds: Flights of each cell and law.
        levels: Values of each parameter, the first varies slowest; ``variant`` may be one of them.
        fixed: Values of dotted paths, as in ``ibvs-qp sweep``.
        paths: Dotted paths that take the value of a parameter, beside those of the experiment.
        laws: Laws that fly; empty means those of the variant.
        fault: What goes wrong after touch, with the parameters of the cell.
        fault_delay_s: Time from touch to the fault [s].
        features: Overrides the features of the command line if given.
        rendered_only: Whether the flights need rendered pictures.
        keep: Whether the log of the first seed is stored.
    """

    measure: str = choice("press", "what is measured", MEASURES)
    seeds: int = setting(1, "flights of each cell and law", low=1)
    levels: dict[str, tuple[Parameter, ...]] = field(default_factory=dict)
    fixed: dict[str, Value] = field(default_factory=dict)
    paths: dict[str, tuple[str, ...]] = field(default_factory=dict)
    laws: tuple[str, ...] = ()
    fault: str = choice("none", "what goes wrong after touch", ("none", "derate", "wind step"))
    fault_delay_s: float = setting(0.0, "time from touch to the fault", unit="s", low=0.0)
    features: str = choice("", "overrides the command line", ("", "rendered", "geometric"))
    rendered_only: bool = False
    keep: bool = True

    def __post_init__(self) -> None:
        """Validate."""
        validate(self)


@dataclass(frozen=True, kw_only=True)
class Panel:
    """One axis of a figure.

    Attributes:
        metric: Metric shown.
        label: Axis label with unit.
        scale: Factor from SI to that unit.
        top: Highest value shown; infinite means as high as the data.
        where: Rows shown, by parameter.
        xlabel: Label along x if it differs from that of the figure.
    """

    metric: str
    label: str
    scale: float = 1.0
    top: float = math.inf
    where: dict[str, Parameter] = field(default_factory=dict)
    xlabel: str = ""


@dataclass(frozen=True, kw_only=True)
class Line:
    """One line of each panel: rows of a variant and of parameter values."""

    label: str
    color: str
    variant: str = "standard"
    where: dict[str, Parameter] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class FigureSpec:
    """A figure of the results page.

    Attributes:
        kind: Key of `sim.experiments.figures.KINDS`.
        name: File name; kinds that draw several files name them themselves.
        caption: Caption.
        x: Parameter along x.
        xlabel: Its label with unit.
        where: Rows shown, by parameter.
        panels: Axes, from left to right.
        variants: Variants drawn first, the first with a full line; other variants in the data follow.
        lines: Lines of each panel, for figures with one row of panels per law.
    """

    kind: str
    name: str = ""
    caption: str = ""
    x: str = ""
    xlabel: str = ""
    where: dict[str, Parameter] = field(default_factory=dict)
    panels: tuple[Panel, ...] = ()
    variants: tuple[str, ...] = ("standard",)
    lines: tuple[Line, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Experiment:
    """One experiment.

    Attributes:
        name: As on the command line.
        title: Heading of its section.
        about: What is flown and measured.
        published: What the paper, or other publications, report.
        params: Parameters of its cells and their headings.
        columns: Metrics of its table.
        criteria: Criteria of the QP law, grouped.
        flights: Flights of the record.
        quick: Flights of ``--quick``.
        figures: Figures.
        paths: Dotted paths that take the value of a parameter.
        named: Values of dotted paths for each value of a parameter.
        fixed: Values of dotted paths for all flights.
        folded: Cells that the page folds away because a figure shows them, by parameter.
    """

    name: str
    title: str
    about: str
    published: str
    params: dict[str, str]
    columns: tuple[Column, ...]
    criteria: tuple[Criteria, ...]
    flights: tuple[Flights, ...]
    quick: tuple[Flights, ...]
    figures: tuple[FigureSpec, ...] = ()
    paths: dict[str, tuple[str, ...]] = field(default_factory=dict)
    named: dict[str, dict[str, dict[str, Value]]] = field(default_factory=dict)
    fixed: dict[str, Value] = field(default_factory=dict)
    folded: dict[str, Parameter] = field(default_factory=dict)

    def every_criterion(self) -> list[Criterion]:
        """The criteria one by one."""
        return [criterion for group in self.criteria for criterion in group.expanded()]

    def is_folded(self, params: dict[str, Any]) -> bool:
        """Whether the page folds a cell away."""
        return bool(self.folded) and self.folded.items() <= params.items()


@functools.cache
def experiment(name: str) -> Experiment:
    """The experiment of a name.

    Raises:
        ConfigError: When its file is missing or refused.
    """
    return load_toml(Experiment, SPECS / f"{name}.toml")
