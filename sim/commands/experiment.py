"""``ibvs-qp experiment``: fly one experiment or all of them under both laws, and report the results."""

from __future__ import annotations

import dataclasses
import difflib
import math
import shlex
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from ibvs_qp.config.errors import ConfigError
from sim.commands.options import (
    World,
    check_jobs,
    check_seed,
    command_line,
    flag,
    interrupted,
    optional,
    usable_cores,
)
from sim.experiments import ALL, FAIR, NAMES
from sim.world.worlds import DEFAULT_WORLD

#: Folder of the record that `--again` reads, unless --out names another.
RECORD = Path("runs/record")

if TYPE_CHECKING:
    from rich.console import Console

    from sim.sweep.design import Run


@dataclasses.dataclass(frozen=True, kw_only=True)
class ExperimentCommand:
    """Fly an experiment under both laws, with paired seeds, and write tables, figures and a results page.

    Example: ibvs-qp experiment force-hold --quick --out runs/force-hold
    """

    name: Annotated[str, tyro.conf.Positional, tyro.conf.arg(metavar="NAME|FILE.toml")]
    """Experiment: force-hold, paint, ablation, noise-sweep, saturation, sloped-edge, friction, gust, rotor-derate,
    approach, payload, rates, mismatch, worlds, rivals, fair, all, or a spec of your own (docs/experiments.md)."""
    again: Annotated[bool, flag] = False
    """Compute every figure again from the traces in --out, without a flight; flights without a trace are flown."""
    quick: Annotated[bool, flag] = False
    """Few cells and seeds: takes minutes, does not replace the record."""
    features: Literal["rendered", "geometric"] = "rendered"
    """Perception: rendered pictures through the vision pipeline, or a sensor model of lines."""
    world: World = DEFAULT_WORLD
    seed: int = 0
    """First seed; the flights of a cell use consecutive seeds."""
    jobs: Annotated[int | None, optional("N")] = None
    """Parallel processes; default: one per core. The results do not depend on it."""
    out: Annotated[Path | None, optional("DIR")] = None
    """Run folder; default: runs/<UTC stamp>, with --again runs/record. Finished flights in it are not flown again."""
    traces: Annotated[bool, flag] = False
    """Keep the inputs of every flight's figures, about 20 kB per second of flight: others can be computed later."""
    plan: Annotated[bool, flag] = False
    """Print the number of flights and their flight time, and stop."""
    json: Annotated[bool, flag] = False
    """Print the summary as one JSON line on standard output, and nothing else."""

    def run(self, words: list[str]) -> int:
        """Fly the missing flights, write tables, figures and page, print the criteria."""
        from rich.console import Console

        from sim.experiments.design import Choice, designs
        from sim.report.rundir import RunFolder

        started = time.perf_counter()
        check_seed(self.seed)
        check_jobs(self.jobs)
        notes = Console(stderr=True, quiet=self.json)
        _check_name(self.name)
        traces = self.traces or self.again
        choice = Choice(
            quick=self.quick,
            seed=self.seed,
            features=self.features,
            traces=traces,
            compiled=True,
            world=self.world,
        )
        runs = designs(self.name, choice)
        _print_plan(Console() if self.plan else notes, runs)
        if self.plan:
            return 0
        with RunFolder.open(self.out or (RECORD if self.again else None), resume=True) as folder:
            return self._fly(runs, folder.path, words, started, notes)

    def _fly(self, runs: Sequence[Run], folder: Path, words: list[str], started: float, notes: Console) -> int:
        from importlib.metadata import version

        import polars as pl
        from rich.console import Console

        from sim.experiments.design import chosen, worlds_of
        from sim.experiments.record import PARTS, flights_again, write_page, write_summary, write_tables
        from sim.experiments.record import summary as summarise
        from sim.flight.working import working
        from sim.report.rundir import as_json
        from sim.sweep import run_sweep
        from sim.sweep.flying import in_order
        from sim.sweep.parts import HEAD
        from sim.sweep.progress import sweep_progress

        title, workers = chosen(self.name)[0].name if self.name != ALL else ALL, self.jobs or usable_cores()
        kept, missing = pl.DataFrame(schema=HEAD), runs
        if self.again:
            with working(notes, "Computing the figures ..."):
                kept, missing = flights_again(folder, title, runs, workers)
            notes.print(f"{kept.height} flights by their traces, {len(missing)} without one are flown", highlight=False)
        with sweep_progress(notes, title) as progress:
            result = run_sweep(missing, folder / PARTS, workers=workers, progress=progress)
        worlds = worlds_of(runs, self.world)
        facts: dict[str, Any] = {
            "command": command_line(words),
            "version": version("ibvs-qp"),
            "quick": self.quick,
            "seed": self.seed,
            "features": self.features,
            "world": " and ".join(dict.fromkeys(world for names in worlds.values() for world in names)),
            "interrupted": result.interrupted,
            "wall_time_s": time.perf_counter() - started,
        }
        experiments, table = chosen(self.name), in_order(runs, (kept, result.table))
        with working(notes, "Comparing ..."):
            write_tables(folder, title, experiments, table)
            content = summarise(title, experiments, table, folder, facts)
        write_summary(folder, content)  # before the figures: an error there must not lose the record
        page = None
        if table.height and not result.interrupted:
            features = " and ".join(dict.fromkeys(run.plan.options.features for run in runs))
            lead = (
                f"{table.height} flights, {features} features, world {facts['world']}, first seed {self.seed}, "
                f"{facts['version']}."
            )
            lead = ("A quick run with few flights, not the record: " if self.quick else "") + lead
            with working(notes, "Drawing the figures ..."):
                page = write_page(folder, experiments, table, lead, self._repeat())
        content["wall_time_s"] = time.perf_counter() - started
        write_summary(folder, content)
        if self.json:
            print(as_json(content))
        else:
            _print_verdicts(Console(), content, worlds)
            if content["false_claims"]:
                print(f"False claims: {content['false_claims']} flights were claimed and not completed; they failed.")
            if page is not None:
                print(f"Results: {page}")
        if result.interrupted:
            return interrupted(words, folder, f"finished flights are in {folder}")
        return 0

    def _repeat(self) -> str:
        """The command that repeats an experiment on any computer, with ``{name}`` in place of its name."""
        words = ["ibvs-qp", "experiment", "NAME", *(["--quick"] if self.quick else [])]
        words += ["--features", self.features] if self.features != "rendered" else []
        words += ["--world", self.world] if self.world != DEFAULT_WORLD else []
        words += ["--seed", str(self.seed)] if self.seed else []
        return shlex.join(words).replace("NAME", self.name if self.name.endswith(".toml") else "{name}")


def _check_name(name: str) -> None:
    """Refuse a name that is neither a shipped experiment nor a file."""
    if name in (*NAMES, FAIR, ALL) or name.endswith(".toml"):
        return
    near = difflib.get_close_matches(name, (*NAMES, FAIR, ALL), n=1)
    hint = f"did you mean {near[0]!r}?" if near else f"allowed are {', '.join((*NAMES, FAIR, ALL))}, or a file.toml"
    raise ConfigError(f"no experiment {name!r}; {hint}")


def _print_plan(console: Console, runs: Sequence[Run]) -> None:
    seconds: dict[str, list[float]] = {}
    for run in runs:
        seconds.setdefault(run.experiment, []).append(run.expected_s)
    if len(seconds) > 1:
        seconds["all"] = [run.expected_s for run in runs]
    for name, times in seconds.items():
        minutes = sum(times) / 60.0
        console.print(f"{name}: {len(times)} flights, about {minutes:.0f} min of flight time", highlight=False)


def _print_verdicts(console: Console, content: dict[str, Any], worlds: Mapping[str, Sequence[str]]) -> None:
    from sim.evaluate.table import terminal_table
    from sim.flight.trace import law_name

    tables: dict[str, list[tuple[str, ...]]] = {}
    for entry in content["verdicts"]:
        words = [
            f"{key} {value:g}" if isinstance(value, float) else f"{key} {value}" for key, value in entry["cell"].items()
        ]
        words += [entry["variant"]] if entry["variant"] != "standard" else []
        words += [law_name(entry["law"])] if entry["law"] != "qp" else []
        figure = entry["figure"] + (f" ({', '.join(words)})" if words else "")
        sign, unit = ">=" if entry["least"] else "<=", f" {entry['unit']}" if entry["unit"] else ""
        median = f"{entry['median']:.3g}{unit}" if math.isfinite(entry["median"]) else "–"
        met = "NO" if entry["words"] == "no" else entry["words"]
        row = (figure, f"{sign} {entry['bound']:.4g}{unit}", median, f"{entry['held']} of {entry['n']}", met)
        tables.setdefault(entry["experiment"], []).append(row)
    headings = ("figure", "bound", "median", "flights", "met")
    for name, rows in tables.items():
        title = f"{name}: criteria, world {' and '.join(worlds[name])}"
        console.print(terminal_table(headings, rows, title, text=headings))
