"""Tables of flights read from files: every column of the type that `sim.sweep.parts.frame` gives it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

import polars as pl

from ibvs_qp.config.errors import ConfigError
from ibvs_qp.config.files import UnreadableFile
from sim.storage.parquet import read_parquet, refuse_what_aborts
from sim.sweep.parts import HEAD, PARAM


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
