"""Content of a report: figures of merit, varied parameters, and the levels of a parameter."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
import polars as pl
from scipy.stats import spearmanr

from ibvs_qp.config.errors import ConfigError
from sim.evaluate.figures import Figure, figure_of
from sim.sweep.parts import PARAM
from sim.sweep.setup import unit_of
from sim.sweep.statistics import figure_names

#: Figures of a report by default, in this order, as far as present.
DEFAULT = ("path_rms_m", "force_rms_n", "tilt_peak_deg", "jitter_n_s")
#: A parameter with more distinct values than MOST_LEVELS is sorted into BINS bins of equal count.
MOST_LEVELS, BINS = 12, 6
#: Fewest rows of a rank correlation.
LEAST_ROWS = 8


@dataclass(frozen=True)
class Levels:
    """A parameter, sorted into levels: its values, or bins of drawn values."""

    label: str  # words with unit
    names: tuple[str, ...]  # of the levels, in order
    level: np.ndarray  # level of every row, (rows,); -1 without a value


def chosen_figures(table: pl.DataFrame, columns: tuple[str, ...]) -> list[Figure]:
    """Figures of a report.

    Args:
        table: Rows.
        columns: Columns; empty takes those of `DEFAULT` that have data.

    Raises:
        ConfigError: On a column that the table does not have.
    """
    have = [name for name in figure_names(table) if table[name].dtype.is_numeric() and table[name].drop_nulls().len()]
    for name in columns:
        if name not in have:
            raise ConfigError(f"no figure {name!r} in the table; it has {', '.join(have) or 'none'}")
    names = columns or tuple(name for name in DEFAULT if name in have) or tuple(have[:3])
    return [figure_of(name) for name in names]


def varied(table: pl.DataFrame) -> list[str]:
    """Columns of parameters with more than one value."""
    return [name for name in table.columns if name.startswith(PARAM) and table[name].drop_nulls().n_unique() > 1]


def parameter_label(column: str) -> str:
    """Last parts of a parameter's path, with unit."""
    path = column.removeprefix(PARAM)
    unit, parts = unit_of(path), path.split(".")
    return ".".join(parts[-3 if parts[-1].isdigit() else -2 :]) + (f" [{unit}]" if unit else "")


def levels(table: pl.DataFrame, column: str) -> Levels:
    """Sort the rows into the levels of a parameter."""
    values, label = table[column], parameter_label(column)
    distinct = values.drop_nulls().unique().sort().to_list()
    if not values.dtype.is_numeric() or len(distinct) <= MOST_LEVELS:
        level = np.array([distinct.index(value) if value is not None else -1 for value in values.to_list()])
        return Levels(label, tuple(_short(value) for value in distinct), level)
    numbers = values.cast(pl.Float64).fill_null(float("nan")).to_numpy()
    edges = np.unique(np.nanquantile(numbers, np.linspace(0.0, 1.0, BINS + 1)))
    level = np.clip(np.searchsorted(edges, numbers, side="right") - 1, 0, len(edges) - 2)
    level[np.isnan(numbers)] = -1
    return Levels(label, tuple(f"{_short(low)}–{_short(high)}" for low, high in itertools.pairwise(edges)), level)


def rank_correlation(table: pl.DataFrame, figures: list[Figure], columns: list[str]) -> np.ndarray:
    """Spearman correlation of every parameter with every figure and with success, (parameters, figures + 1).

    NaN with too few rows, or where one of both does not vary.
    """
    result = np.full((len(columns), len(figures) + 1), np.nan)
    merits = [table[figure.name] for figure in figures] + [table["completed"]]
    for row, column in enumerate(columns):
        if not table[column].dtype.is_numeric():
            continue
        for place, merit in enumerate(merits):
            pair = pl.DataFrame([table[column].cast(pl.Float64), merit.cast(pl.Float64)]).drop_nulls().to_numpy()
            if len(pair) >= LEAST_ROWS and np.ptp(pair, axis=0).all():
                result[row, place] = spearmanr(pair[:, 0], pair[:, 1])[0]
    return result


def most_influential(table: pl.DataFrame, figures: list[Figure], columns: list[str], most: int) -> list[str]:
    """The parameters with the largest influence on the figures, in the order of the table."""
    if len(columns) <= most:
        return columns
    strength = np.nan_to_num(np.abs(rank_correlation(table, figures, columns))).sum(axis=1)
    return [columns[index] for index in sorted(np.argsort(-strength, kind="stable")[:most])]


def _short(value: object) -> str:
    return f"{value:.3g}" if isinstance(value, float) else str(value)
