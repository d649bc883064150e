"""What a report of a sweep shows: figures of merit, varied parameters, and the levels that rows are sorted into."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
import polars as pl
from scipy.stats import spearmanr

from ibvs_qp.config.errors import ConfigError
from sim.sweep.parts import PARAM
from sim.sweep.setup import unit_of
from sim.sweep.statistics import figure_names

#: Column to words, factor to the shown unit, and that unit; shown by default, in this order, where there is data.
KNOWN = {
    "path_rms_m": ("path error, rms", 1e3, "mm"),
    "force_rms_n": ("push error, rms", 1.0, "N"),
    "tilt_peak_deg": ("tilt, peak", 1.0, "deg"),
    "jitter_n_s": ("thrust rate, rms", 1.0, "N/s"),
}
#: Further figures that are shown on demand in other than their own unit.
ON_DEMAND = {
    "path_max_m": ("path error, greatest", 1e3, "mm"),
    "height_error_rms_m": ("height error, rms", 1e3, "mm"),
    "coverage": ("coverage", 100.0, "%"),
    "contact_share": ("contact", 100.0, "%"),
}
#: A parameter with more different values than this is sorted into so many bins of equal count.
MOST_LEVELS, BINS = 12, 6
#: A figure of rank correlation needs so many rows.
LEAST_ROWS = 8


@dataclass(frozen=True)
class Figure:
    """A figure of merit and how it is shown."""

    column: str
    words: str
    scale: float
    unit: str

    @property
    def label(self) -> str:
        """Words with unit."""
        return f"{self.words} [{self.unit}]" if self.unit else self.words


@dataclass(frozen=True)
class Levels:
    """A parameter, sorted into levels: its values, or bins of drawn values.

    Attributes:
        column: Of the table.
        label: Words with unit.
        names: Of the levels, in order.
        level: Level of every row, (rows,); -1 where it has no value.
    """

    column: str
    label: str
    names: tuple[str, ...]
    level: np.ndarray


def chosen_figures(table: pl.DataFrame, wanted: tuple[str, ...]) -> list[Figure]:
    """Figures to show.

    Args:
        table: Rows.
        wanted: Columns; empty takes those of `KNOWN` that have data.

    Raises:
        ConfigError: On a column that the table does not have.
    """
    have = [name for name in figure_names(table) if table[name].dtype.is_numeric() and table[name].drop_nulls().len()]
    for name in wanted:
        if name not in have:
            raise ConfigError(f"no figure {name!r} in the table; it has {', '.join(have) or 'none'}")
    names = wanted or tuple(name for name in KNOWN if name in have) or tuple(have[:3])
    return [Figure(name, *(KNOWN | ON_DEMAND).get(name, (name, 1.0, ""))) for name in names]


def varied(table: pl.DataFrame) -> list[str]:
    """Columns of parameters that take more than one value."""
    return [name for name in table.columns if name.startswith(PARAM) and table[name].drop_nulls().n_unique() > 1]


def levels(table: pl.DataFrame, column: str) -> Levels:
    """Sort the rows into the levels of a parameter."""
    values = table[column]
    path = column.removeprefix(PARAM)
    unit = unit_of(path)
    parts = path.split(".")
    label = ".".join(parts[-3 if parts[-1].isdigit() else -2 :]) + (f" [{unit}]" if unit else "")
    distinct = values.drop_nulls().unique().sort()
    if not values.dtype.is_numeric() or len(distinct) <= MOST_LEVELS:
        place = {value: index for index, value in enumerate(distinct.to_list())}
        level = np.array([place.get(value, -1) for value in values.to_list()])
        return Levels(column, label, tuple(_short(value) for value in place), level)
    numbers = values.cast(pl.Float64).fill_null(float("nan")).to_numpy()
    edges = np.unique(np.nanquantile(numbers, np.linspace(0.0, 1.0, BINS + 1)))
    level = np.clip(np.searchsorted(edges, numbers, side="right") - 1, 0, len(edges) - 2)
    level[np.isnan(numbers)] = -1
    names = tuple(f"{_short(low)}–{_short(high)}" for low, high in itertools.pairwise(edges))
    return Levels(column, label, names, level)


def rank_correlation(table: pl.DataFrame, figures: list[Figure], columns: list[str]) -> np.ndarray:
    """Spearman correlation of every parameter with every figure and with success, (parameters, figures + 1).

    NaN where there are too few rows, or one of both does not vary.
    """
    result = np.full((len(columns), len(figures) + 1), np.nan)
    merits = [table[figure.column] for figure in figures] + [table["completed"]]
    for row, column in enumerate(columns):
        if not table[column].dtype.is_numeric():
            continue
        for place, merit in enumerate(merits):
            pair = pl.DataFrame([table[column].cast(pl.Float64), merit.cast(pl.Float64)]).drop_nulls().to_numpy()
            if len(pair) >= LEAST_ROWS and np.ptp(pair, axis=0).all():
                result[row, place] = spearmanr(pair[:, 0], pair[:, 1])[0]
    return result


def telling(table: pl.DataFrame, figures: list[Figure], columns: list[str], most: int) -> list[str]:
    """The parameters on which most depends, in the order of the table."""
    if len(columns) <= most:
        return columns
    strength = np.nan_to_num(np.abs(rank_correlation(table, figures, columns))).sum(axis=1)
    kept = sorted(np.argsort(-strength, kind="stable")[:most])
    return [columns[index] for index in kept]


def _short(value: object) -> str:
    return f"{value:.3g}" if isinstance(value, float) else str(value)
