"""The table of a noise sweep: read, checked, and asked what noise costs."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from ibvs_qp.config.errors import ConfigError
from sim.notebook.noise.sample import SAMPLE
from sim.sweep.parts import PARAM

VS, FORCE = PARAM + "sigma_vs", PARAM + "sigma_f_n"
#: Columns without which a table is no noise sweep.
NEEDED = ("law", "seed", "completed", "reason", VS, FORCE)
#: Camera distance in contact [m]: sigma_vs times this is the noise of a line on the wall.
DEPTH_M = 0.5


@dataclass(frozen=True, kw_only=True)
class Figure:
    """A column to look at: words with unit, factor into that unit, and whether more of it is better."""

    column: str
    words: str
    scale: float = 1.0
    more_is_better: bool = False


FIGURES = (
    Figure(column="path_rms_m", words="path error, rms [mm]", scale=1e3),
    Figure(column="force_rms_n", words="push error, rms [N]"),
    Figure(column="path_max_m", words="path error, greatest [mm]", scale=1e3),
    Figure(column="tilt_rms_deg", words="tilt, rms [deg]"),
    Figure(column="yaw_rms_deg", words="yaw, rms [deg]"),
    Figure(column="velocity_rms_m_s", words="error of the estimated velocity, rms [mm/s]", scale=1e3),
    Figure(column="coverage", words="painted share of the intended band [%]", scale=1e2, more_is_better=True),
    Figure(column="limited_share", words="ticks with an active limit [%]", scale=1e2),
    Figure(column="duration_s", words="duration [s]"),
)


def figure_named(words: str) -> Figure:
    """The figure of these words."""
    return next(figure for figure in FIGURES if figure.words == words)


def read_sweep(file: str) -> pl.DataFrame:
    """A noise sweep's table; without a file name the sample that comes with the notebooks.

    Raises:
        ConfigError: When there is no such file, or it is no noise sweep.
    """
    path = Path(file) if file else SAMPLE
    if not path.is_file():
        raise ConfigError(f"no file {file}; ibvs-qp experiment noise-sweep writes one")
    try:
        table = pl.read_parquet(path)
    except pl.exceptions.PolarsError as error:
        raise ConfigError(f"{path.name}: not a Parquet table ({str(error).splitlines()[0]})") from error
    missing = [name for name in NEEDED if name not in table.columns]
    if missing:
        raise ConfigError(f"{path.name}: not a noise sweep, no column {', '.join(missing)}")
    return table


def sweep_or_sample(file: str) -> tuple[pl.DataFrame, str]:
    """The table, and what is wrong with the file if the sample had to stand in for it."""
    try:
        return read_sweep(file), ""
    except ConfigError as error:
        return read_sweep(""), f"{error}. Shown is the sample."


def grid_of(table: pl.DataFrame) -> tuple[list[float], list[float]]:
    """Values of sigma_vs and of sigma_f, ascending."""
    return sorted(table[VS].unique()), sorted(table[FORCE].unique())


def cell_values(table: pl.DataFrame, law: str, vs: float, force: float, figure: Figure) -> np.ndarray:
    """Figure of the completed flights of a cell, in its unit."""
    if figure.column not in table.columns:
        return np.array([])
    rows = table.filter((pl.col("law") == law) & (pl.col(VS) == vs) & (pl.col(FORCE) == force) & pl.col("completed"))
    return figure.scale * rows[figure.column].drop_nulls().to_numpy()


def success(table: pl.DataFrame) -> pl.DataFrame:
    """Flights and share completed per law and cell."""
    keys = ["law", VS, FORCE]
    counts = table.group_by(keys).agg(pl.len().alias("flights"), pl.col("completed").mean().alias("completed"))
    return counts.sort(keys)


def reasons(table: pl.DataFrame) -> list[dict[str, Any]]:
    """Why flights were not completed, most frequent first."""
    failed = table.filter(~pl.col("completed"))
    counts = failed.group_by("law", "reason").len().sort(["len", "law", "reason"], descending=[True, False, False])
    return counts.to_dicts()
