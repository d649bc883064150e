"""``ibvs-qp compare``: differences between two runs, or between two presets flown on the same seeds."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from sim.commands.options import (
    World,
    check_count,
    check_jobs,
    check_seed,
    command_line,
    flag,
    interrupted,
    optional,
    preset_file,
    usable_cores,
)
from sim.world.worlds import DEFAULT_WORLD

if TYPE_CHECKING:
    import polars as pl

#: Differences of scenes and presets in the terminal; the JSON line holds all.
MOST_CONDITIONS = 30
#: Most flights of each preset [-]: half a day on two cores.
MOST_SEEDS = 1000


@dataclasses.dataclass(frozen=True, kw_only=True)
class Compare:
    """Compare two run folders, or fly two presets on the same seeds and compare them: B minus A, flight by flight.

    Example: ibvs-qp compare runs/before runs/after
    """

    run_a: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="RUN_A")]
    """Folder of `paint` or `experiment`, or a preset (TOML)."""
    run_b: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="RUN_B")]
    """The other run or preset, of the same kind."""
    law: Literal["qp", "paper", "own"] = "own"
    """Presets only: law to fly; own takes the law that each preset names."""
    seeds: int = 3
    """Presets only: flights of each preset."""
    seed: int = 0
    """Presets only: first seed."""
    features: Literal["rendered", "geometric"] = "rendered"
    """Presets only: perception."""
    world: World = DEFAULT_WORLD
    quick: Annotated[bool, flag] = False
    """Presets only: fly a short paint job."""
    jobs: Annotated[int | None, optional("N")] = None
    """Presets only: parallel processes; default: one per core."""
    out: Annotated[Path | None, optional("DIR")] = None
    """Presets only: run folder; default: runs/<UTC stamp>."""
    json: Annotated[bool, flag] = False
    """Print one line of JSON on standard output, and nothing else."""

    def run(self, words: list[str]) -> int:
        """Read or fly both, and print the differences."""
        from ibvs_qp.pilot.presets import FILES

        a, b = (path if path.exists() else FILES.get(str(path), path) for path in (self.run_a, self.run_b))
        return dataclasses.replace(self, run_a=a, run_b=b)._compare(words)

    def _compare(self, words: list[str]) -> int:
        from rich.console import Console

        from sim.flight.working import working
        from sim.report.comparison import compare, differing_presets, differing_runs, read_run, run_world
        from sim.report.rundir import as_json

        folder, stopped, presets = None, False, self._presets()
        conditions = (differing_presets if presets else differing_runs)(self.run_a, self.run_b)
        if presets:
            a, b, folder, stopped = self._fly()
        else:
            a, b = read_run(self.run_a), read_run(self.run_b)
        with working(Console(stderr=True, quiet=self.json), "Comparing ..."):
            cells = [] if stopped else compare(a, b)
        if self.json:
            content: dict[str, Any] = {
                "schema": 1,
                "command": command_line(words),
                "run_a": str(self.run_a),
                "run_b": str(self.run_b),
                "world": None if folder is None else self.world,
                "run_dir": None if folder is None else str(folder),
                "interrupted": stopped,
                "conditions": conditions,
                "cells": cells,
            }
            print(as_json(content))
        elif not stopped:
            named = [self.world] if presets else [run_world(run) or "unknown" for run in (self.run_a, self.run_b)]
            _print(conditions, cells, self.run_a, self.run_b, " against ".join(dict.fromkeys(named)))
        if stopped and folder is not None:
            return interrupted(words, folder, f"finished flights are in {folder}")
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
        if files[0]:
            for name, file in (("RUN_A", self.run_a), ("RUN_B", self.run_b)):
                preset_file(file, name)
        return files[0]

    def _fly(self) -> tuple[pl.DataFrame, pl.DataFrame, Path, bool]:
        import polars as pl
        from rich.console import Console

        from sim.experiments.preset_flights import preset_runs
        from sim.report.rundir import RunFolder
        from sim.sweep import run_sweep
        from sim.sweep.progress import sweep_progress

        check_seed(self.seed)
        check_count("--seeds", self.seeds, 1, MOST_SEEDS)
        check_jobs(self.jobs)
        runs = [
            run
            for name, file in (("a", self.run_a), ("b", self.run_b))
            for run in preset_runs(
                name, file, self.law, range(self.seed, self.seed + self.seeds), self.features, self.quick, self.world
            )
        ]
        progress_bar = sweep_progress(Console(stderr=True, quiet=self.json), "compare")
        with RunFolder.open(self.out, resume=True) as run, progress_bar as progress:
            folder = run.path
            result = run_sweep(runs, folder / "parts", workers=self.jobs or usable_cores(), progress=progress)
        if "variant" not in result.table.columns:  # stopped before the first flight ended
            return result.table, result.table, folder, True
        variants = [result.table.filter(pl.col("variant") == name) for name in ("a", "b")]
        # Preset against preset: with --law own the two flights pair although their laws may differ.
        alike = [pl.lit("preset").alias("variant"), *([pl.lit("own").alias("law")] if self.law == "own" else [])]
        a, b = (table.with_columns(alike) for table in variants)
        return a, b, folder, result.interrupted


def _print(conditions: list[dict[str, Any]], cells: list[dict[str, Any]], a: Path, b: Path, world: str) -> None:
    from rich.console import Console

    from sim.evaluate.metrics import LINES
    from sim.evaluate.table import plain, terminal_table
    from sim.flight.trace import law_name
    from sim.report.comparison import ABSENT, PAINT_VARIANT
    from sim.sweep.statistics import needed, spread

    console, names = Console(), ("A", "B")
    print(f"A: {a}\nB: {b}")
    shown = [(plain(each["name"]), plain(each["a"]), plain(each["b"])) for each in conditions[:MOST_CONDITIONS]]
    if len(conditions) > MOST_CONDITIONS:
        shown.append((f"{len(conditions) - MOST_CONDITIONS} more, see --json", "", ""))
    if shown:
        console.print(terminal_table(("flown under other conditions", *names), shown, wrap=names))
    for cell in cells:
        variant = [] if cell["variant"] == PAINT_VARIANT else [cell["variant"]]
        params = (f"{name} {value}" for name, value in cell["params"].items())
        labels = [cell["experiment"], law_name(cell["law"]), *variant, *params]
        done = " and ".join(f"{count} of {cell['n']}" for count in cell["completed"])
        where = "" if "world" in cell["params"] else f"; world {world}"
        rows = []
        for line in LINES:
            if (found := cell["differences"].get(line.name)) is None:
                continue
            figures = [line.scale * found[key] for key in ("a", "b", "median", "low", "high")]
            a_text, b_text = (f"{figure:.4g}" for figure in figures[:2])
            median, low, high = (f"{figure:+.4g}" for figure in figures[2:])
            interval = spread(low, high, found["pairs"]) if low != high else ABSENT
            rows.append((plain(line.label), a_text, b_text, median, interval))
        enough = {found["pairs"] >= needed() for found in cell["differences"].values()}
        spreads = (*(["95 %"] if True in enough else []), *(["min, max"] if False in enough else []))
        headings = ("figure", *names, "B - A", " or ".join(spreads))
        console.print(terminal_table(headings, rows, plain(f"{', '.join(labels)}: completed {done}{where}")))
