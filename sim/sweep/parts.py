"""Parquet parts of a sweep: complete or absent, named by hash, joined in the order of the design."""

from __future__ import annotations

import io
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import polars as pl

from ibvs_qp.config.errors import ConfigError
from ibvs_qp.config.files import UnreadableFile
from sim.storage.atomic import replacing
from sim.storage.parquet import read_parquet, refuse_what_aborts

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


def read_tables(files: Iterable[Path], needed: Sequence[str] = (), *, foreign: bool = False) -> pl.DataFrame:
    """One table of several files, in the given order; a column that a file lacks is null there.

    Args:
        files: Parquet files.
        needed: Columns that the table must have.
        foreign: Whether the files are a user's and not parts of this run.

    Raises:
        ConfigError: When a file is no table of flights, or a needed column is missing.
    """
    files = list(files)
    if foreign and files:
        refuse_what_aborts(files)
    tables = [_typed(file, read_parquet(file)) for file in files]
    try:
        table = pl.concat(tables, how="diagonal_relaxed") if tables else pl.DataFrame(schema=HEAD)
    except pl.exceptions.PolarsError as error:
        raise ConfigError(f"the tables do not fit together: {str(error).splitlines()[0]}") from None
    if missing := [name for name in needed if name not in table.columns]:
        raise ConfigError(f"no table of flights: it lacks {', '.join(missing)}")
    return table


def _typed(file: Path, table: pl.DataFrame) -> pl.DataFrame:
    for name, kind in table.schema.items():
        number, empty = kind.is_numeric(), kind == pl.Null
        fits = (
            kind == HEAD[name]
            if name in HEAD
            else number or (name.startswith(PARAM) and kind in (pl.Boolean, pl.String))
        )
        if not (fits or empty):
            raise UnreadableFile(file, f"no table of flights: column {name!r} has type {kind}")
    return table
