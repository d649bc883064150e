"""One experiment as data: its flights, the columns of its table, criteria of the QP law, and figures.

Each experiment is one file ``specs/NAME.toml``. Unknown keys and wrong types are errors.
"""

from __future__ import annotations

import dataclasses
import difflib
import functools
import itertools
import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ibvs_qp.config.errors import ConfigError, out_of_range
from ibvs_qp.config.settings import choice, load_toml, setting, validate
from sim.evaluate.figures import FIGURES, figure_of
from sim.experiments import ALL, FAIR, NAMES
from sim.experiments.variants import VARIANTS, Variant
from sim.sweep.design import Parameter

#: Statistic that a bound applies to: the median of the cell, or each of its flights (flags, peaks, counts of mishaps).
MEDIAN, EVERY = "median", "every flight"


@dataclass(frozen=True, kw_only=True)
class Bound:
    """A bound on one metric: exactly one of `at_most`, `at_least` and `ratio_at_most` is given."""

    text: str  # label; {name:g} inserts a parameter of the cell
    metric: str  # column of the table of flights
    at_most: float = math.nan  # upper bound, in SI
    at_least: float = math.nan  # lower bound, in SI
    ratio_at_most: float = math.nan  # upper bound of the median ratio to reference flights with the same seeds
    against: dict[str, Parameter] = field(default_factory=dict)  # parameters in which those flights differ
    before: str = ""  # or a table of such flights by an earlier revision, a file in ``goals``
    statistic: str = choice(MEDIAN, "statistic that the bound applies to", (MEDIAN, EVERY))
    share: float = setting(
        1.0, "fraction of flights that must be within a bound on every flight, or have a value", low=0.0, high=1.0
    )
    include_failed: bool = False  # whether flights that did not end as planned count with their values
    reason: str = ""  # why this bound

    def __post_init__(self) -> None:
        """Validate."""
        validate(self)
        if sum(not math.isnan(bound) for bound in (self.at_most, self.at_least, self.ratio_at_most)) != 1:
            raise ConfigError(f"bound {self.text!r} needs one of at_most, at_least and ratio_at_most")
        if self.is_ratio and (self.every or bool(self.against) == bool(self.before)):
            raise ConfigError(f"bound {self.text!r} is a ratio of medians, and needs either against or before")

    @property
    def is_ratio(self) -> bool:
        """Whether the bound is that of a ratio."""
        return not math.isnan(self.ratio_at_most)

    @property
    def least(self) -> bool:
        """Whether the bound is a lower one."""
        return not math.isnan(self.at_least)

    @property
    def bound(self) -> float:
        """The bound, in SI."""
        return self.at_least if self.least else self.ratio_at_most if self.is_ratio else self.at_most

    @property
    def scale(self) -> float:
        """Factor from SI to the unit shown."""
        return 1.0 if self.is_ratio else figure_of(self.metric).scale

    @property
    def unit(self) -> str:
        """Unit shown."""
        return "" if self.is_ratio else figure_of(self.metric).unit

    @property
    def every(self) -> bool:
        """Whether each flight must satisfy the bound."""
        return self.statistic == EVERY


@dataclass(frozen=True, kw_only=True)
class Criterion(Bound):
    """A bound with the law, the variant and the cells that it applies to; empty `where` means all cells."""

    law: str = "qp"
    variant: str = "standard"
    where: dict[str, Parameter] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class Criteria:
    """Bounds that apply to the same variants and cells."""

    bounds: tuple[Bound, ...]
    where: dict[str, Parameter] = field(default_factory=dict)  # parameters that all cells share
    cells: tuple[dict[str, Parameter], ...] = ({},)  # further parameters of each cell
    laws: tuple[str, ...] = ("qp",)
    variants: tuple[str, ...] = ("standard",)

    def expanded(self) -> Iterator[Criterion]:
        """One criterion per law, variant, cell and bound."""
        for law, variant, cell in itertools.product(self.laws, self.variants, self.cells):
            for bound in self.bounds:
                values = {each.name: getattr(bound, each.name) for each in dataclasses.fields(bound)}
                where = self.where | cell
                values["text"] = bound.text.format(**where)
                yield Criterion(**values, law=law, variant=variant, where=where)


SPECS = Path(__file__).with_name("specs")
#: Value of a dotted path of scene, pilot or job; integers stay integers.
Value = int | float | bool | str | tuple[float, ...]

#: Of a column: as for its figure.
OF_FIGURE = 99


#: Experiments of the user's by name, once they are loaded.
_own: dict[str, Experiment] = {}


@dataclass(frozen=True, kw_only=True)
class Column:
    """A metric shown in the tables of an experiment."""

    metric: str  # name of the figure, column of the table of flights
    label: str = ""  # heading where the measure means something narrower than the figure's words
    digits: int = OF_FIGURE  # decimals
    better: int = OF_FIGURE  # direction
    of_all: bool = False  # whether flights that did not end as planned have the metric too
    where: dict[str, Parameter] = field(default_factory=dict)  # cells with this metric; empty means all

    def __post_init__(self) -> None:
        """Fill in the values of the figure."""
        figure = figure_of(self.metric)
        filled = {"label": self.label or figure.words, "digits": figure.digits, "better": figure.better}
        for name, value in filled.items():
            if getattr(self, name) in ("", OF_FIGURE):
                object.__setattr__(self, name, value)

    @property
    def unit(self) -> str:
        """Unit shown."""
        return figure_of(self.metric).unit

    @property
    def scale(self) -> float:
        """Factor from SI to the unit."""
        return figure_of(self.metric).scale


@dataclass(frozen=True, kw_only=True)
class Flights:
    """Flights of one kind: every combination of the levels, under each law with the same seeds."""

    measure: str = choice(
        "press",
        "measured job; paint paints, paint_timed also times perception, the others press",
        ("paint", "paint_timed", "press", "slide", "loss"),
    )
    seeds: int = setting(1, "flights of each cell and law", low=1)
    levels: dict[str, tuple[Parameter, ...]] = field(default_factory=dict)  # first slowest; also variant, world
    fixed: dict[str, Value] = field(default_factory=dict)  # values of dotted paths, as in ibvs-qp sweep
    strategy: str = ""  # class of a strategy of the user's that replaces the job of the measure
    paths: dict[str, tuple[str, ...]] = field(default_factory=dict)  # further paths that take a parameter's value
    laws: tuple[str, ...] = ()  # laws of the flights; empty means those of the variant
    scene: str = choice("default", "scene; random is one per seed, the same under every law", ("default", "random"))
    fault: str = choice("none", "fault", ("none", "derate", "thrust loss", "wind step"))
    fault_after: str = choice("touch", "event that starts its delay", ("start", "touch"))
    fault_delay_s: float = setting(0.0, "time from then to the fault", unit="s", low=0.0)
    features: str = choice("", "overrides the command line", ("", "rendered", "geometric"))
    supervised: bool = False  # whether the supervisor flies along: a lost rotor is its case
    rendered_only: bool = False  # whether the flights need rendered pictures
    keep: bool = True  # whether the log of the first seed is stored

    def __post_init__(self) -> None:
        """Validate."""
        validate(self)


@dataclass(frozen=True, kw_only=True)
class Panel:
    """One axis of a figure."""

    metric: str
    label: str  # with unit
    top: float = math.inf  # highest value shown
    where: dict[str, Parameter] = field(default_factory=dict)  # rows shown
    xlabel: str = ""  # if it differs from that of the figure

    @property
    def scale(self) -> float:
        """Factor from SI to the unit of the label."""
        return figure_of(self.metric).scale


@dataclass(frozen=True, kw_only=True)
class Line:
    """One line of each panel: rows of a variant and of parameter values."""

    label: str
    color: str
    variant: str = "standard"
    where: dict[str, Parameter] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class FigureSpec:
    """A figure of the results page."""

    kind: str  # key of sim.experiments.figures.KINDS
    name: str = ""  # file name; kinds with several files name them themselves
    caption: str = ""
    x: str = ""  # parameter along x
    xlabel: str = ""  # with unit
    where: dict[str, Parameter] = field(default_factory=dict)  # rows shown
    panels: tuple[Panel, ...] = ()  # from left to right
    variants: tuple[str, ...] = ("standard",)  # drawn first, the first with a full line; others in the data follow
    lines: tuple[Line, ...] = ()  # lines of each panel of kind "rows"
    draw: tuple[str, ...] = ()  # figures of a run folder (sim.figures.FIGURES) of kind "flights"


@dataclass(frozen=True, kw_only=True)
class Experiment:
    """One experiment."""

    name: str  # as on the command line
    title: str  # heading of its section
    about: str  # flights and measurements
    params: dict[str, str]  # parameters of its cells and their headings
    columns: tuple[Column, ...]
    flights: tuple[Flights, ...]  # of the record
    published: str = "–"  # figures of the paper, or of other publications
    criteria: tuple[Criteria, ...] = ()
    quick: tuple[Flights, ...] = ()  # of --quick; without any it flies all
    figures: tuple[FigureSpec, ...] = ()
    paths: dict[str, tuple[str, ...]] = field(default_factory=dict)  # dotted paths that take a parameter's value
    named: dict[str, dict[str, dict[str, Value]]] = field(default_factory=dict)  # paths set by a parameter's value
    fixed: dict[str, Value] = field(default_factory=dict)  # values of dotted paths for all flights
    world: str = ""  # of flights without a level `world`; empty takes that of the command line
    folded: dict[str, Parameter] = field(default_factory=dict)  # cells that the page folds away: a figure shows them
    variants: dict[str, Variant] = field(default_factory=dict)  # of its own, beside those of variants.toml

    def every_criterion(self) -> list[Criterion]:
        """The criteria one by one."""
        return [criterion for group in self.criteria for criterion in group.expanded()]

    def is_folded(self, params: dict[str, Any]) -> bool:
        """Whether the page folds a cell away."""
        return bool(self.folded) and self.folded.items() <= params.items()


def _check_own(found: Experiment) -> None:
    """Refuse misspelt figures and variants, and parameters without a level, of a spec of the user's."""
    for column in found.columns:
        if column.metric not in FIGURES:
            near = difflib.get_close_matches(column.metric, FIGURES, n=1)
            raise out_of_range("columns.metric", column.metric, "", f"no figure has this name; near: {near or 'none'}")
    for variant, own in found.variants.items():
        if VARIANTS.get(variant, own) != own:
            raise out_of_range("variants", variant, "", "another variant has this name")
    known = VARIANTS | found.variants
    for flights in (*found.flights, *found.quick):
        for variant in flights.levels.get("variant", ()):
            if variant not in known:
                raise out_of_range("levels.variant", variant, "", f"allowed are {', '.join(known)}")
        if missing := found.params.keys() - flights.levels.keys():
            raise out_of_range("levels", list(flights.levels), "", f"it lacks {', '.join(sorted(missing))} of params")


@functools.cache
def experiment(name: str) -> Experiment:
    """The experiment of a name, or of a spec of the user's (a TOML file), which then has its own name as well.

    Raises:
        ConfigError: When its file is missing or refused, or it redefines a shipped name.
    """
    if name in _own:
        return _own[name]
    if not name.endswith(".toml"):
        return load_toml(Experiment, SPECS / f"{name}.toml")
    found = load_toml(Experiment, Path(name))
    if not re.fullmatch(r"[A-Za-z0-9_-]+", found.name) or found.name in (*NAMES, FAIR, ALL):
        raise out_of_range("name", found.name, "", "allowed are letters, digits, - and _, and no name of a shipped one")
    _check_own(found)
    VARIANTS.update(found.variants)
    _own[found.name] = found
    return found
