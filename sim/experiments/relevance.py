"""Meaning of a paired difference: better, worse, practically irrelevant, or not decided by the data."""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum

from sim.evaluate.figures import figure_of
from sim.experiments.spec import Column
from sim.sweep.paired import sign
from sim.sweep.statistics import needed


class Effect(Enum):
    """Outcome of a comparison of a first law or variant with a second one."""

    FIRST = "first better"
    IRRELEVANT = "does not matter"
    SECOND = "second better"
    OPEN = "undecided"
    FEW = "too few pairs"


def threshold(column: Column) -> float:
    """Least difference of a column that matters, in its unit.

    Raises:
        KeyError: When neither its figure nor its unit has one.
    """
    return figure_of(column.metric).least[0]


def effect(found: Mapping[str, float], column: Column) -> Effect:
    """Effect of a difference, second minus first, as of `sim.sweep.paired.difference`, with its ``pairs``.

    Better takes an exact interval without zero and a median of at least the threshold. An interval with zero in it
    shows that a difference does not matter only if it lies within the threshold as a whole.
    """
    if found["pairs"] < needed():
        return Effect.FEW
    least = threshold(column) / column.scale
    if max(abs(found["sure_low"]), abs(found["sure_high"])) < least:
        return Effect.IRRELEVANT
    side = -(column.better or 0) * sign(dict(found))
    if not side:
        return Effect.OPEN
    if abs(found["median"]) < least:
        return Effect.IRRELEVANT
    return Effect.FIRST if side > 0 else Effect.SECOND
