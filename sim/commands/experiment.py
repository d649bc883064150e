"""``ibvs-qp experiment``: fly one of the experiments, or all, under both laws and report it."""

from __future__ import annotations

import dataclasses
import math
import os
import shlex
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from sim.commands.options import check_count, flag, go_on, optional

if TYPE_CHECKING:
    from rich.console import Console

    from sim.sweep.design import Run

Name = Literal[
    "force-hold",
    "paint",
    "noise-sweep",
    "saturation",
    "sloped-edge",
    "friction",
    "gust",
    "rotor-derate",
    "approach",
    "payload",
    "all",
]


@dataclasses.dataclass(frozen=True, kw_only=True)
class ExperimentCommand:
    """Fly an experiment under both laws, with paired seeds, and write tables, figures and a results page.

    Example: ibvs-qp experiment force-hold --quick --out runs/force-hold
    """

    name: Annotated[Name, tyro.conf.Positional, tyro.conf.arg(metavar="NAME")]
    """Which: force-hold, paint, noise-sweep, saturation, sloped-edge, friction, gust, rotor-derate, approach, payload
    or all."""
    quick: Annotated[bool, flag] = False
    """Few cells and seeds: minutes, not the record."""
    features: Literal["rendered", "geometric"] = "rendered"
    """Perception: rendered pictures through the whole vision, or a sensor model of lines."""
    seed: int = 0
    """First seed; flights of a cell take this and the following ones."""
    jobs: Annotated[int | None, optional("N")] = None
    """Processes side by side; default: one per core. The results do not depend on it."""
    out: Annotated[Path | None, optional("DIR")] = None
    """Folder; default: runs/<UTC stamp>. Given one with finished flights, only the others are flown."""
    plan: Annotated[bool, flag] = False
    """Print how many flights there are and how long they fly, and stop."""
    json: Annotated[bool, flag] = False
    """Print the summary as one line on standard output, and nothing else."""

    def run(self, words: list[str]) -> int:
        """Fly what is not on disk yet, then write and print everything.

        Args:
            words: The command line, for the record.

        Returns:
            0, or 130 after Ctrl-C.

        Raises:
            IbvsQpError: When seed, jobs or folder is refused.
        """
        from importlib.metadata import version

        from rich.console import Console

        from sim.commands.checks import check_seed
        from sim.experiments import Choice, chosen, designs
        from sim.experiments.record import PARTS, write_page, write_summary, write_tables
        from sim.experiments.record import summary as summarise
        from sim.report.rundir import RunFolder, as_json
        from sim.sweep import run_sweep
        from sim.sweep.progress import sweep_progress

        started = time.perf_counter()
        check_seed(self.seed)
        check_count("--jobs", self.jobs)
        notes = Console(stderr=True, quiet=self.json)
        choice = Choice(quick=self.quick, seed=self.seed, features=self.features)
        runs = designs(self.name, choice)
        _print_plan(Console() if self.plan else notes, runs)
        if self.plan:
            return 0
        folder = RunFolder.create(self.out).path
        with sweep_progress(notes, self.name) as progress:
            result = run_sweep(
                runs, folder / PARTS, workers=self.jobs or _cores(), progress=progress, timed=progress.timed
            )
        facts: dict[str, Any] = {
            "command": shlex.join(["ibvs-qp", *words]),
            "version": version("ibvs-qp"),
            "quick": self.quick,
            "seed": self.seed,
            "features": self.features,
            "interrupted": result.interrupted,
            "wall_time_s": time.perf_counter() - started,
        }
        experiments, table = chosen(self.name), result.table
        write_tables(folder, self.name, experiments, table)
        content = summarise(self.name, experiments, table, folder, facts)
        write_summary(folder, content)  # before the figures, so that no figure can cost the record
        page = None
        if table.height and not result.interrupted:
            lead = f"{table.height} flights, {self.features} features, first seed {self.seed}, {facts['version']}."
            lead = ("A quick run with few flights, not the record: " if self.quick else "") + lead
            with notes.status("Drawing the figures ..."):
                page = write_page(folder, experiments, table, lead, self._again(), self.name)
        content["wall_time_s"] = time.perf_counter() - started
        write_summary(folder, content)
        if self.json:
            print(as_json(content))
        else:
            _print_verdicts(Console(), content)
            if page is not None:
                Console().print(f"Results: {page}", soft_wrap=True, highlight=False)
        if result.interrupted:
            again = go_on(words, folder)
            print(f"ibvs-qp: interrupted; finished flights are in {folder}; go on with: {again}", file=sys.stderr)
            return 130
        return 0

    def _again(self) -> str:
        """The command that flies one experiment alike on any computer, with ``{name}`` where its name goes."""
        words = ["ibvs-qp", "experiment", "NAME", *(["--quick"] if self.quick else [])]
        words += ["--features", self.features] if self.features != "rendered" else []
        words += ["--seed", str(self.seed)] if self.seed else []
        return shlex.join(words).replace("NAME", "{name}")


def _cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _print_plan(console: Console, runs: Sequence[Run]) -> None:
    totals: dict[str, list[float]] = {}
    for run in runs:
        entry = totals.setdefault(run.experiment, [0, 0.0])
        entry[0] += 1
        entry[1] += run.expected_s
    for name, (count, seconds) in totals.items():
        console.print(f"{name}: {count:.0f} flights, about {seconds / 60.0:.0f} min in the air", highlight=False)
    if len(totals) > 1:
        minutes = sum(entry[1] for entry in totals.values()) / 60.0
        console.print(f"all: {len(runs)} flights, about {minutes:.0f} min in the air", highlight=False)


def _print_verdicts(console: Console, content: dict[str, Any]) -> None:
    from rich import box
    from rich.table import Table

    for name in dict.fromkeys(entry["experiment"] for entry in content["verdicts"]):
        table = Table(box=box.SIMPLE_HEAD, pad_edge=False, title=f"{name}: QP law held to", title_justify="left")
        for heading in ("figure", "bound", "median", "flights", "met"):
            table.add_column(heading, no_wrap=heading != "figure")
        for entry in (entry for entry in content["verdicts"] if entry["experiment"] == name):
            words = [f"{key} {_short(value)}" for key, value in entry["cell"].items()]
            words += [entry["variant"]] if entry["variant"] != "standard" else []
            figure = entry["figure"] + (f" ({', '.join(words)})" if words else "")
            sign, unit = ">=" if entry["least"] else "<=", f" {entry['unit']}" if entry["unit"] else ""
            median = f"{entry['median']:.3g}{unit}" if math.isfinite(entry["median"]) else "–"
            held = f"{entry['held']} of {entry['n']}"
            table.add_row(
                figure,
                f"{sign} {entry['bound']:.4g}{unit}",
                median,
                held,
                "NO" if entry["words"] == "no" else entry["words"],
            )
        console.print(table)


def _short(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)
