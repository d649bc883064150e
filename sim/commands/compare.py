"""``ibvs-qp compare``: two runs, or two presets flown alike, figure by figure."""

from __future__ import annotations

import dataclasses
import os
import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from sim.commands.options import check_count, flag, go_on, optional

if TYPE_CHECKING:
    import polars as pl

#: Figures shown first; the rest is in the JSON.
SHOWN = (
    "path_rms_straight_m", "path_rms_corner_m", "path_rms_m", "force_rms_straight_n", "force_rms_corner_n",
    "force_rms_n", "force_peak_n", "contact_share", "tilt_rms_deg", "tilt_peak_deg", "yaw_peak_deg",
    "height_error_rms_m", "settle_s", "bounces", "coverage", "push_mean_n",
)  # fmt: skip


@dataclasses.dataclass(frozen=True, kw_only=True)
class Compare:
    """Compare two run folders, or fly two presets alike and compare them; B minus A, flight by flight.

    Example: ibvs-qp compare runs/before runs/after
    """

    run_a: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="RUN_A")]
    """Folder of `paint` or `experiment`, or a preset (TOML)."""
    run_b: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="RUN_B")]
    """The other one, of the same kind."""
    law: Literal["qp", "paper", "own"] = "own"
    """Presets only: which law flies them; own takes the one that each preset names."""
    seeds: int = 3
    """Presets only: flights of each."""
    seed: int = 0
    """Presets only: first seed."""
    features: Literal["rendered", "geometric"] = "rendered"
    """Presets only: perception."""
    quick: Annotated[bool, flag] = False
    """Presets only: a short paint job instead of the whole one."""
    jobs: Annotated[int | None, optional("N")] = None
    """Presets only: processes side by side; default: one per core."""
    out: Annotated[Path | None, optional("DIR")] = None
    """Presets only: folder of the flights; default: runs/<UTC stamp>."""
    json: Annotated[bool, flag] = False
    """Print one line of JSON on standard output, and nothing else."""

    def run(self, words: list[str]) -> int:
        """Read or fly both, and print the differences.

        Args:
            words: The command line, for the record.

        Returns:
            0, or 130 after Ctrl-C while presets fly.

        Raises:
            IbvsQpError: When a run or a preset is refused.
        """
        from sim.report.comparison import compare, read_run
        from sim.report.rundir import as_json

        folder, interrupted = None, False
        if self._presets():
            a, b, folder, interrupted = self._fly()
        else:
            a, b = read_run(self.run_a), read_run(self.run_b)
        cells = [] if interrupted else compare(a, b)
        if self.json:
            content: dict[str, Any] = {
                "schema": 1,
                "command": shlex.join(["ibvs-qp", *words]),
                "run_a": str(self.run_a),
                "run_b": str(self.run_b),
                "run_dir": None if folder is None else str(folder),
                "interrupted": interrupted,
                "cells": [
                    {**cell, "differences": {each.figure: _plain(each) for each in cell["differences"]}}
                    for cell in cells
                ],
            }
            print(as_json(content))
        elif not interrupted:
            _print(cells, self.run_a, self.run_b)
        if interrupted and folder is not None:
            again = go_on(words, folder)
            print(f"ibvs-qp: interrupted; finished flights are in {folder}; go on with: {again}", file=sys.stderr)
            return 130
        return 0

    def _presets(self) -> bool:
        """Whether both are presets; False when both are folders.

        Raises:
            ConfigError: When one is a preset and the other a folder, or one does not exist.
        """
        from ibvs_qp.config.errors import ConfigError

        for path in (self.run_a, self.run_b):
            if not path.exists():
                raise ConfigError(f"{path} does not exist; give two run folders or two presets (TOML)")
        files = [path.is_file() for path in (self.run_a, self.run_b)]
        if files[0] != files[1]:
            file, folder = (self.run_a, self.run_b) if files[0] else (self.run_b, self.run_a)
            raise ConfigError(
                f"{file} is a file and {folder} a folder; give two run folders or two presets (TOML) to compare"
            )
        return files[0]

    def _fly(self) -> tuple[pl.DataFrame, pl.DataFrame, Path, bool]:
        import polars as pl
        from rich.console import Console

        from sim.commands.checks import check_preset, check_readable, check_seed
        from sim.experiments.preset_flights import preset_runs
        from sim.report.rundir import RunFolder
        from sim.sweep import run_sweep
        from sim.sweep.progress import sweep_progress

        check_seed(self.seed)
        check_count("--seeds", self.seeds)
        check_count("--jobs", self.jobs)
        for option, file in (("RUN_A", self.run_a), ("RUN_B", self.run_b)):
            check_readable(option, file)
            check_preset(file)
        runs = [
            run
            for name, file in (("a", self.run_a), ("b", self.run_b))
            for run in preset_runs(
                name, file, self.law, range(self.seed, self.seed + self.seeds), self.features, self.quick
            )
        ]
        folder = RunFolder.create(self.out).path
        with sweep_progress(Console(stderr=True, quiet=self.json), "compare") as progress:
            result = run_sweep(runs, folder / "parts", workers=self.jobs or _cores(), progress=progress)
        if "variant" not in result.table.columns:  # stopped before the first flight was done
            return result.table, result.table, folder, True
        variants = [result.table.filter(pl.col("variant") == name) for name in ("a", "b")]
        # What is compared is preset against preset, whatever law each of them names.
        alike = [pl.lit("preset").alias("variant"), *([pl.lit("own").alias("law")] if self.law == "own" else [])]
        a, b = (table.with_columns(alike) for table in variants)
        return a, b, folder, result.interrupted


def _cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _plain(difference: Any) -> dict[str, float]:
    return {name: value for name, value in dataclasses.asdict(difference).items() if name != "figure"}


def _print(cells: list[dict[str, Any]], a: Path, b: Path) -> None:
    from rich import box
    from rich.console import Console
    from rich.table import Table

    for cell in cells:
        params = ", ".join(f"{name} {value}" for name, value in cell["params"].items())
        done = " and ".join(f"{count} of {cell['n']}" for count in cell["completed"])
        title = f"{cell['experiment']}, {cell['law']}, {cell['variant']}{', ' + params if params else ''}: done {done}"
        table = Table(box=box.SIMPLE_HEAD, pad_edge=False, title=title, title_justify="left")
        for heading in ("figure", f"A: {a.name}", f"B: {b.name}", "B - A", "95 % interval"):
            table.add_column(heading, justify="left" if heading == "figure" else "right", no_wrap=heading == "figure")
        shown = {each.figure: each for each in cell["differences"]}
        for name in (name for name in SHOWN if name in shown):
            each = shown[name]
            interval = f"{each.low:+.4g} to {each.high:+.4g}" if each.low != each.high else "one flight"
            table.add_row(name, f"{each.a:.4g}", f"{each.b:.4g}", f"{each.median:+.4g}", interval)
        Console().print(table)
