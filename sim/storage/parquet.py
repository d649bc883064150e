"""Parquet from files of unknown origin."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import polars as pl

from ibvs_qp.config.files import UnreadableFile, open_regular
from sim.storage.arrays import no_library_output
from sim.storage.limits import LARGEST_TABLE, MOST_CELLS

#: Decodes the files of its arguments, and prints a line before each: the last one is that which ended it.
_DECODE = """
import pathlib, sys
from sim.storage.parquet import read_parquet
from ibvs_qp.config.files import UnreadableFile
for file in sys.argv[1:]:
    print(flush=True)
    try:
        read_parquet(pathlib.Path(file))
    except UnreadableFile:
        pass
"""


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


def refuse_what_aborts(files: Sequence[Path]) -> None:
    """Decode files that this package did not write in a process of its own, before ours reads them.

    Polars allocates the length of a damaged file, and aborts its process if that exceeds the memory.

    Raises:
        UnreadableFile: When decoding a file ended that process.
    """
    words = [sys.executable, "-P", "-c", _DECODE, *(str(file) for file in files)]  # imports nothing from the folder
    done = subprocess.run(words, capture_output=True, check=False)  # nosec B603
    if done.returncode > 0:  # an error of the decoder, not of a file
        raise RuntimeError(done.stderr.decode(errors="replace"))
    if done.returncode:
        raise UnreadableFile(files[max(done.stdout.count(b"\n") - 1, 0)], "no Parquet table (Polars cannot decode it)")
