"""Parquet from files of unknown origin."""

from __future__ import annotations

from pathlib import Path

import polars as pl

from ibvs_qp.config.files import UnreadableFile, open_regular
from sim.storage.limits import LARGEST_TABLE, MOST_CELLS
from sim.storage.quiet import no_library_output


def read_parquet(file: Path) -> pl.DataFrame:
    """The table in a Parquet file.

    Raises:
        UnreadableFile: When it cannot be read, is no table, or has more cells than `MOST_CELLS`.
    """
    with open_regular(file, LARGEST_TABLE) as stream, no_library_output():
        try:
            cells = len(pl.read_parquet_schema(stream)) * pl.scan_parquet(stream).select(pl.len()).collect().item()
            if cells > MOST_CELLS:
                raise UnreadableFile(file, f"it has {cells} cells, at most {MOST_CELLS} are read")
            stream.seek(0)
            return pl.read_parquet(stream)
        except (pl.exceptions.PolarsError, pl.exceptions.PanicException, OSError, ValueError, OverflowError) as error:
            raise UnreadableFile(file, f"no Parquet table ({str(error).splitlines()[0]})") from None
