"""QP law against the analytic law with each allocator that it flew with, and with the best of them."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import polars as pl

from ibvs_qp.config import ControllerConfig
from sim.experiments.relevance import Effect, effect
from sim.experiments.spec import Column, Experiment
from sim.experiments.variants import REFERENCES, VARIANTS, Variant
from sim.experiments.wording import measured, value_of
from sim.sweep.paired import differences
from sim.sweep.statistics import completed, parameters, select, split

#: Allocator of the analytic law as shipped.
SHIPPED = ControllerConfig().allocator
#: Variants of the comparison: those that ablations are compared with.
BASES = tuple(name for name in VARIANTS if any(name in against for against in REFERENCES.values()))


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """One metric in one cell: analytic law minus QP law, seed by seed, over flights that both ended as planned."""

    experiment: Experiment
    column: Column
    variant: str  # of both laws, apart from the allocator
    params: dict[str, Any]
    allocator: str  # of the analytic law
    best: bool  # whether no allocator did better here
    found: dict[str, float]  # difference, in SI

    @property
    def effect(self) -> Effect:
        """Effect; "first" is the QP law."""
        return effect(self.found, self.column)


def _bare(variant: Variant) -> Variant:
    """A variant without its allocator and words, to compare its other switches."""
    switches = {name: value for name, value in variant.switches.items() if name != "allocator"}
    return dataclasses.replace(variant, words="", switches=switches, laws=(), against=())


def allocators(variant: str) -> dict[str, str]:
    """Variants of the analytic law that differ from a variant in the allocator only, by allocator."""
    same = {
        str(other.switches["allocator"]): name
        for name, other in VARIANTS.items()
        if "allocator" in other.switches and "paper" in other.laws and _bare(other) == _bare(VARIANTS[variant])
    }
    return {SHIPPED: variant} | same


def rivals(rows: pl.DataFrame, variant: str) -> dict[str, pl.DataFrame]:
    """Flights of the analytic law by allocator, without allocators that did not fly."""
    flown = {name: select(rows, law="paper", variant=other) for name, other in allocators(variant).items()}
    return {name: part for name, part in flown.items() if part.height}


def best_allocator(flown: dict[str, pl.DataFrame], column: Column) -> str:
    """The allocator with the largest fraction of flights that ended as planned, then with the best median."""

    def rank(name: str) -> tuple[float, float]:
        values = completed(flown[name], column.metric) if column.metric in flown[name].columns else np.zeros(0)
        error = -column.better * float(np.median(values)) if len(values) else np.inf
        return (-float(flown[name]["completed"].mean()), error)  # type: ignore[arg-type]

    return min(flown, key=rank)


def compared_cells(
    experiment: Experiment, table: pl.DataFrame, variants: Sequence[str] = BASES
) -> Iterator[tuple[str, dict[str, Any], pl.DataFrame, dict[str, pl.DataFrame]]]:
    """Variant, parameters, flights of the QP law and of the analytic law by allocator, of unfolded cells of both."""
    for key, rows in split(table, ("experiment",)):
        params = parameters(key)
        for variant in () if experiment.is_folded(params) else variants:
            qp, flown = select(rows, law="qp", variant=variant), rivals(rows, variant)
            if qp.height and flown:
                yield variant, params, qp, flown


def comparisons(experiment: Experiment, table: pl.DataFrame) -> list[Comparison]:
    """Every metric with a direction in every cell with flights of both laws, against every allocator."""
    columns = [column for column in measured(experiment, table) if column.better]
    result = []
    for variant, params, qp, flown in compared_cells(experiment, table):
        found = {
            name: differences(qp, part, [column.metric for column in columns])["differences"]
            for name, part in flown.items()
        }
        for column in columns:
            best = best_allocator(flown, column)
            for allocator, each in found.items():
                if (difference := value_of(each, column, params)) is not None:
                    result.append(
                        Comparison(experiment=experiment, column=column, variant=variant, params=params,
                                   allocator=allocator, best=allocator == best, found=difference)
                    )  # fmt: skip
    return result
