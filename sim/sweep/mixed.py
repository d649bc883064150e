r"""One mixed model over the seeds and cells of two laws, each flown with both sets of gains.

.. math:: \log y_{lgcs} = \mu + \alpha l + \beta g + \gamma l g + b_c + b_{cs} + \varepsilon

with law l and gains g of -1/2 (QP) or 1/2 (analytic law), and random intercepts of the cell c and of the seed s in it.
:math:`e^\alpha` is then the analytic law over the QP at equal gains, and :math:`e^\beta` the gains of the analytic law
over those of the QP under the same law. It stands beside the paired intervals of the cells and replaces none.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import polars as pl

from sim.sweep.statistics import split

#: Law and gains of a flight by its law and variant; own gains are those of the law.
CROSSED = {
    ("qp", "standard"): (-0.5, -0.5),
    ("qp", "exchanged-gains"): (-0.5, 0.5),
    ("paper", "shared-gains"): (0.5, -0.5),
    ("paper", "standard"): (0.5, 0.5),
}


class Ratio(NamedTuple):
    """A ratio with its 95 % interval by the model."""

    ratio: float
    low: float
    high: float

    def __str__(self) -> str:
        """Ratio and interval as text."""
        return f"{self.ratio:.2f} ({self.low:.2f} to {self.high:.2f})"


def law_and_gains(table: pl.DataFrame, metric: str) -> Mapping[str, Ratio]:
    """Effects of ``law``, ``gains`` and their ``interaction`` on a figure that is above zero.

    Args:
        table: Flights of the four variants of `CROSSED`.
        metric: Figure; flights that did not end as planned, or without it, are left out.

    Source: `statsmodels.regression.mixed_linear_model.MixedLM`, restricted maximum likelihood.
    """
    import pandas as pd
    import statsmodels.formula.api as smf

    rows = []
    for place, (_, cell) in enumerate(split(table, ("experiment",))):
        for row in cell.filter(pl.col("completed")).iter_rows(named=True):
            crossed, value = CROSSED.get((row["law"], row["variant"])), row[metric]
            if crossed is not None and value is not None and value > 0.0:
                rows.append((place, f"{place}.{row['seed']}", *crossed, np.log(value)))
    data = pd.DataFrame(rows, columns=["cell", "seed", "law", "gains", "y"])
    model = smf.mixedlm("y ~ law * gains", data, groups="cell", re_formula="1", vc_formula={"seed": "0 + C(seed)"})
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a variance at its bound of zero is no fault here
        fitted = model.fit(reml=True, method="lbfgs")
    if not fitted.converged:
        return {name: Ratio(math.nan, math.nan, math.nan) for name in ("law", "gains", "interaction")}
    ends = fitted.conf_int()
    names = {"law": "law", "gains": "gains", "interaction": "law:gains"}
    return {
        name: Ratio(*(float(np.exp(value)) for value in (fitted.params[term], *ends.loc[term])))
        for name, term in names.items()
    }
