"""Parquet parts of a sweep: complete or absent, named by hash, joined in the order of the design."""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import polars as pl

from sim.storage.atomic import replacing

#: Columns of every row, before parameters and figures.
HEAD = {
    "experiment": pl.String,
    "law": pl.String,
    "variant": pl.String,
    "seed": pl.Int64,
    "completed": pl.Boolean,  # by the truth, and claimed by the pilot
    "claimed": pl.Boolean,  # by the pilot alone
    "reason": pl.String,
    "config_hash": pl.String,
    "code_hash": pl.String,
    "version": pl.String,
    "log": pl.String,  # folder of the whole log
    "trace": pl.String,  # file of the inputs of the figures (`sim.flight.trace_log`)
}
#: Prefix of parameter columns.
PARAM = "param."


def part_file(folder: Path, name: str) -> Path:
    """File of a block."""
    return folder / f"part-{name}.parquet"


def write_table(file: Path, table: pl.DataFrame) -> None:
    """Write a table so that neither a reader nor a crash meets half a file."""
    with replacing(file) as stream:  # written by Python: Polars hides why the system refuses a file
        table.write_parquet(content := io.BytesIO())
        stream.write(content.getbuffer())


def frame(rows: Sequence[dict[str, Any]]) -> pl.DataFrame:
    """Rows as a table: typed head columns, every figure a float, parameters of their own type."""
    schema: dict[str, Any] = dict(HEAD)
    for row in rows:
        for name, value in row.items():
            if name not in schema:
                schema[name] = _kind(value) if name.startswith(PARAM) else pl.Float64
    return pl.DataFrame(list(rows), schema=schema, strict=False, orient="row")


def _kind(value: Any) -> Any:
    return pl.Boolean if isinstance(value, bool) else pl.String if isinstance(value, str) else pl.Float64
