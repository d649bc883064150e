"""A part of a list of flights from the command line: flown into a folder that the parts share."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

import polars as pl
from rich.console import Console

from sim.sweep import run_sweep
from sim.sweep.design import Run
from sim.sweep.fingerprint import listed_block
from sim.sweep.parts import part_file
from sim.sweep.progress import sweep_progress
from sim.sweep.tables import read_tables


def add_part_options(parser: argparse.ArgumentParser, out: str) -> None:
    """Options of `fly_part`; ``out`` is the default folder."""
    parser.add_argument("--part", type=int, default=1, help="part to fly, from 1; 0 only prints the figures")
    parser.add_argument("--of", type=int, default=1, help="number of parts, of about the same flight time")
    parser.add_argument("--jobs", type=int, default=1, help="processes side by side")
    parser.add_argument("--out", type=Path, default=Path(out), help="folder that the parts share")


def parse_part(parser: argparse.ArgumentParser) -> argparse.Namespace:
    """The command line, its part checked."""
    given = parser.parse_args()
    if not 0 <= given.part <= given.of:
        parser.error(f"--part must be from 0 to {given.of}")
    return given


def fly_part(
    runs: Sequence[Run], chosen: Sequence[Run], given: argparse.Namespace, words: str
) -> tuple[pl.DataFrame, bool]:
    """Fly the part of the chosen flights that is missing in the folder.

    Args:
        runs: Flights of the table.
        chosen: Those of them to fly, of which the part is taken.
        given: Of `parse_part`.
        words: Name of the flights, for the progress bar.

    Returns:
        Table of all flights in the folder with the present code, and whether the user stopped them.
    """
    part = chosen[given.part - 1 :: given.of] if given.part else []
    with sweep_progress(Console(), words) as progress:
        result = run_sweep(part, given.out, workers=given.jobs, progress=progress)
    files = [part_file(given.out, listed_block([run]).name) for run in runs]
    return read_tables(file for file in files if file.exists()), result.interrupted
