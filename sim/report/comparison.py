"""Compare two runs: pair their flights and list the differences of their figures."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from ibvs_qp.config.errors import ConfigError
from sim.report.summary_file import read_laws
from sim.sweep.paired import difference
from sim.sweep.parts import PARAM, frame
from sim.sweep.statistics import figure_names, median_interval
from sim.sweep.tables import read_tables

#: Columns that identify a flight, besides the parameters.
_SAME = ("experiment", "law", "variant", "seed")
#: Variant of the flights of a `paint` run, which has no others.
PAINT_VARIANT = "run"


def read_run(path: Path) -> pl.DataFrame:
    """Rows of a run folder: of an experiment's tables, or one per law of a `paint` run.

    Raises:
        ConfigError: If it is neither.
    """
    if (path / "summary.json").is_file():
        return _paint_rows(path)
    names = [file.stem for file in sorted(path.glob("*.parquet"))]
    names = [name for name in names if name != "all"] or names
    if not names:
        advice = "give the folder of `ibvs-qp paint` or `ibvs-qp experiment`, or a preset (TOML)"
        raise ConfigError(f"{path} is no run: it has neither summary.json nor a table; {advice}")
    return read_tables((path / f"{name}.parquet" for name in names), (*_SAME, "completed"), foreign=True)


def _paint_rows(path: Path) -> pl.DataFrame:
    facts, laws = read_laws(path / "summary.json")
    same = {"experiment": "paint", "variant": PAINT_VARIANT, "seed": facts["seed"], "version": facts["version"]}
    return frame([metrics | same | {"law": law} for law, metrics in laws.items()])


def compare(a: pl.DataFrame, b: pl.DataFrame) -> list[dict[str, Any]]:
    """Pair the flights of two runs by experiment, law, variant, parameters and seed, and compare each cell.

    Two `paint` runs pair law by law, for any seeds.

    Returns:
        Per cell: experiment, law, variant, params, n, completed of both, and by figure the differences.

    Raises:
        ConfigError: If they share no flight.
    """
    if set(a["variant"]) == {PAINT_VARIANT} == set(b["variant"]):
        b = b.with_columns(pl.lit(a["seed"][0]).alias("seed"))
    params = [name for name in a.columns if name.startswith(PARAM) and name in b.columns]
    try:
        both = a.join(b, on=[*_SAME, *params], suffix=".b", nulls_equal=True, maintain_order="left")
    except pl.exceptions.PolarsError as error:  # a parameter of another type, a figure with the suffix
        raise ConfigError(f"the two runs do not fit together: {str(error).splitlines()[0]}") from None
    if not both.height:
        raise ConfigError("the two runs share no flight (same experiment, law, variant, parameters and seed)")
    shared = [name for name in figure_names(a) if name in b.columns]
    cells = []
    for key, rows in both.group_by(["experiment", "law", "variant", *params], maintain_order=True):
        values = dict(zip(["experiment", "law", "variant", *params], key, strict=True))
        cells.append(
            {
                **{name: values[name] for name in ("experiment", "law", "variant")},
                "params": {name.removeprefix(PARAM): values[name] for name in params if values[name] is not None},
                "n": rows.height,
                "completed": [int(rows["completed"].sum()), int(rows["completed.b"].sum())],
                "differences": {name: found for name in shared if (found := _difference(rows, name)) is not None},
            }
        )
    return cells


def _difference(rows: pl.DataFrame, name: str) -> dict[str, float] | None:
    """Medians of run A and B, and of B - A flight by flight with both intervals; number of pairs of flights."""
    first, second = (rows[column].cast(pl.Float64).to_numpy() for column in (name, f"{name}.b"))
    if not np.isfinite(second - first).any():
        return None
    medians = {"a": median_interval(first)["median"], "b": median_interval(second)["median"]}
    return medians | difference(second - first) | {"pairs": int(np.isfinite(second - first).sum())}
