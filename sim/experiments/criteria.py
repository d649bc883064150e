"""Criteria of a law as data: bounds on metrics, and the variants and cells that they apply to."""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass, field

from ibvs_qp.config.errors import ConfigError
from ibvs_qp.config.settings import choice, setting, validate
from sim.evaluate.figures import figure_of
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
