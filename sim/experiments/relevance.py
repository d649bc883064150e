"""What a paired difference means: better, worse, practically irrelevant, or not decided by the data."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from pathlib import Path

from ibvs_qp.config.settings import load_toml
from sim.experiments.spec import Column
from sim.sweep.paired import sign
from sim.sweep.statistics import needed


@dataclass(frozen=True, kw_only=True)
class Threshold:
    """Least difference that matters."""

    least: float  # in `unit`
    reason: str  # why
    unit: str = ""  # unit of the columns
    metrics: tuple[str, ...] = ()  # columns; empty means all others of the unit


@dataclass(frozen=True, kw_only=True)
class Thresholds:
    """Content of ``relevance.toml``."""

    thresholds: tuple[Threshold, ...]


THRESHOLDS = load_toml(Thresholds, Path(__file__).with_name("relevance.toml")).thresholds


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
        KeyError: When ``relevance.toml`` has none for the column.
    """
    own = [each.least for each in THRESHOLDS if column.metric in each.metrics]
    shared = [each.least for each in THRESHOLDS if each.unit == column.unit and each.unit and not each.metrics]
    for least in (*own, *shared):
        return least
    raise KeyError(f"relevance.toml has no threshold for {column.metric!r} [{column.unit}]")


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
    side = -column.better * sign(dict(found))
    if not side:
        return Effect.OPEN
    if abs(found["median"]) < least:
        return Effect.IRRELEVANT
    return Effect.FIRST if side > 0 else Effect.SECOND
