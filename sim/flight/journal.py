"""Rows of a flight on disk while it flies, so that a killed process leaves them; `unfinished` reads them.

Two files per law: ``LAW.rows`` has the numbers of every tick, ``LAW.jsonl`` a line on the flight, then one per chunk
with its events, active limits and times of perception. A chunk is complete or is dropped by the reader.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from ibvs_qp.config.errors import IbvsQpError


class Columns:
    """Named columns of one or more numbers each.

    Args:
        widths: Numbers per row of each column, in the order of a row.
        dtype: Type of the stored numbers.
    """

    def __init__(self, widths: dict[str, int], dtype: type = np.float64) -> None:
        self._widths, self._dtype = widths, dtype
        self._rows: list[np.ndarray] = []

    def __len__(self) -> int:
        """Rows so far."""
        return len(self._rows)

    def add(self, *parts: np.ndarray) -> None:
        """Append a row: its numbers in the order of the columns, split into 1-D arrays at will."""
        self._rows.append(np.concatenate(parts, dtype=self._dtype))

    def rows(self, first: int, end: int) -> list[np.ndarray]:
        """Some rows."""
        return self._rows[first:end]

    def arrays(self) -> dict[str, np.ndarray]:
        """Every column so far, (N,) or (N, width)."""
        return split(np.array(self._rows, self._dtype).reshape(len(self), sum(self._widths.values())), self._widths)


def split(table: np.ndarray, widths: dict[str, int]) -> dict[str, np.ndarray]:
    """Columns of a table by name, (N,) or (N, width)."""
    columns = np.split(table, np.cumsum(list(widths.values()))[:-1], axis=1)
    return {
        name: np.ascontiguousarray(column[:, 0] if width == 1 else column)
        for (name, width), column in zip(widths.items(), columns, strict=True)
    }


#: Flight time in a chunk [s]: the most that a killed process loses.
CHUNK_S = 0.1
ROWS, NOTES = ".rows", ".jsonl"


@dataclass(frozen=True)
class Header:
    """The first line of the notes."""

    law: str
    seed: int
    scene: str  # TOML
    preset: str  # TOML
    columns: dict[str, int]  # width of each column of double precision, in their order
    program: int  # inputs and states of the program, in single precision; 0 for none

    @property
    def row(self) -> np.dtype:
        """One tick in the file of rows."""
        return np.dtype([("log", "<f8", (sum(self.columns.values()),)), ("program", "<f4", (self.program,))])


class Journal:
    """Appends chunks of ticks to the files of one flight.

    Args:
        folder: Folder of the files.
        header: The first line.

    Raises:
        IbvsQpError: When the files cannot be written; likewise `append`.
    """

    def __init__(self, folder: Path, header: Header) -> None:
        self._folder, self._row = folder, header.row
        self._files: list[BinaryIO] = []
        self._call(lambda: self._open(header))

    def append(self, logs: Sequence[np.ndarray], programs: Sequence[np.ndarray], note: dict[str, Any]) -> None:
        """Append a chunk: rows of the log and of the program, and events.

        Args:
            logs: Numbers of every tick, (columns,) each.
            programs: Inputs and states of the program, (P,) each; empty without a program.
            note: Events, active limits and times of perception, as JSON.
        """
        rows = np.zeros(len(logs), self._row)
        if logs:
            rows["log"] = logs
        if programs:
            rows["program"] = programs
        self._call(lambda: self._write((json.dumps(note) + "\n").encode(), rows.tobytes()))

    def close(self) -> None:
        """Close the files."""
        for file in self._files:
            file.close()

    def _open(self, header: Header) -> None:
        self._folder.mkdir(parents=True, exist_ok=True)
        for suffix in (NOTES, ROWS):
            self._files.append(open(self._folder / f"{header.law}{suffix}", "wb", buffering=0))
        self._write((json.dumps(vars(header)) + "\n").encode(), b"")

    def _write(self, *contents: bytes) -> None:
        for file, content in zip(self._files, contents, strict=True):
            left = memoryview(content)
            while left:
                left = left[file.write(left) :]

    def _call(self, work: Any) -> None:
        try:
            work()
        except OSError as error:
            raise IbvsQpError(
                f"cannot write the log of the flight: {error.strerror or error}; its first part is in {self._folder}"
            ) from None
