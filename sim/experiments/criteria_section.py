"""Bounds of the QP law on the results pages: how many are met, and which are not."""

from __future__ import annotations

import numpy as np

from sim.evaluate.table import markdown
from sim.experiments.spec import Experiment
from sim.experiments.verdict import Verdict, verdicts
from sim.experiments.verdict_section import Flown, capped
from sim.experiments.wording import cell

_HEADS = ("experiment", "metric", "cell", "bound", "median", "worst flight", "flights within", "met")


def criteria_section(flown: Flown) -> str:
    """Number of bounds met per experiment, and a table of those not met."""
    found = [(experiment, verdicts(experiment, table)) for experiment, table in flown]
    met = [f"{each.name} {sum(v.met for v in all_)} of {len(all_)}" for each, all_ in found if all_]
    missed = [_row(each, verdict) for each, all_ in found for verdict in all_ if not verdict.met]
    total, good = sum(len(all_) for _, all_ in found), sum(v.met for _, all_ in found for v in all_)
    text = f"{good} of {total} bounds of the QP law are met: {', '.join(met)}.\n\n"
    return text + (f"Not met:\n\n{capped(_HEADS, missed)}" if missed else "")


def criteria_table(flown: Flown) -> str:
    """Every bound."""
    return markdown(_HEADS, [_row(each, verdict) for each, table in flown for verdict in verdicts(each, table)])


def _row(experiment: Experiment, verdict: Verdict) -> list[str]:
    criterion = verdict.criterion
    unit = f" {criterion.unit}" if criterion.unit else ""
    sign = (">=" if criterion.least else "<=") + (" every" if criterion.every and criterion.share == 1.0 else "")
    share = f" in {100.0 * criterion.share:.0f} %" if criterion.every and criterion.share < 1.0 else ""
    where = cell(experiment, verdict.place) or "all"
    where += f", {criterion.variant}" if criterion.variant != "standard" else ""
    values = (f"{value:.3g}{unit}" if np.isfinite(value) else "–" for value in (verdict.median, verdict.worst))
    met = "**no**" if verdict.words == "no" else verdict.words
    bound, within = f"{sign} {verdict.bound:.4g}{unit}{share}", f"{verdict.within} of {verdict.n}"
    return [experiment.name, criterion.text, where, bound, *values, within, met]
