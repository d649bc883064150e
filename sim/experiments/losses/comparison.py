"""Every figure of every cell of the QP against every opponent in it."""

from __future__ import annotations

import polars as pl

from sim.experiments.comparison import Comparison, against
from sim.experiments.losses.flights import base_of
from sim.experiments.spec import experiment
from sim.sweep.statistics import parameters, split


def comparisons(table: pl.DataFrame) -> list[Comparison]:
    """Every figure of every cell of the QP's flights against every opponent in it.

    An opponent that flies like an earlier one, because their gains differ only where the cell has no use for them, is
    no further comparison.

    Args:
        table: Flights of `sim.experiments.losses.flights.runs_of`.
    """
    found = []
    for key, rows in split(table, ("experiment",)):
        flown: list[pl.DataFrame] = []
        figures = {"seed", "completed"} | {each.metric for each in experiment(key["experiment"]).columns if each.better}
        for (law, variant), theirs in rows.group_by("law", "variant", maintain_order=True):
            base = base_of(str(variant))
            if law == "qp" and not str(variant).endswith("mpc"):
                continue
            mine = rows.filter((pl.col("law") == "qp") & (pl.col("variant") == base))
            if mine.is_empty():
                continue
            flights = theirs.sort("seed").select(pl.lit(base), *sorted(figures & set(theirs.columns)))
            if any(flights.equals(each) for each in flown):
                continue
            flown.append(flights)
            name = str(variant) if law == "qp" else f"analytic law, {variant}"
            columns = experiment(key["experiment"]).columns
            found += against(key["experiment"], parameters(key), name, mine, theirs, columns)
    return found
