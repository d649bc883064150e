"""``ibvs-qp faults``: fly the fault matrix with and without the supervisor, score every flight, and report."""

from __future__ import annotations

import dataclasses
import shlex
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from sim.commands.options import (
    check_count,
    check_jobs,
    check_seed,
    command_line,
    flag,
    interrupted,
    optional,
    usable_cores,
)

if TYPE_CHECKING:
    from rich.console import Console

    from sim.fault_matrix.design import Choice
    from sim.fault_matrix.verdict import Verdict
    from sim.sweep.design import Run

#: Simulated over wall-clock time of one core, for the estimate of the plan [-]: measured on geometric flights.
REAL_TIME_FACTOR = 5.0
#: Most flights of a row, place and world [-]: ten times the record; the plan of all rows then takes 6 s.
MOST_SEEDS = 200


@dataclasses.dataclass(frozen=True, kw_only=True)
class Faults:
    """Fly the fault matrix with and without the supervisor, and report which rows pass.

    Example: ibvs-qp faults --quick --rows "F/T*" --out runs/faults
    """

    quick: Annotated[bool, flag] = False
    """One seed in the world datasheet: takes minutes to an hour, does not replace the record."""
    seeds: Annotated[int | None, optional("N")] = None
    """Flights of every row, place and world; default: 20, one with --quick. Without the supervisor at most 3."""
    rows: Annotated[str, tyro.conf.arg(metavar="PATTERN", help_behavior_hint="")] = "*"
    """Names of the rows to fly, with the wildcards * and ?; default: all."""
    world: Annotated[str | None, optional("NAME")] = None
    """World: ideal, datasheet, harsh, field, or a TOML file; default: ideal and datasheet."""
    unsupervised: Annotated[bool, flag] = False
    """Only the flights without the supervisor."""
    controller: Annotated[str | None, optional("MODULE:CLASS")] = None
    """Control law of your own in place of the QP: module:Class or file.py:Class (docs/extending.md)."""
    seed: int = 0
    """First seed; the flights of a row use consecutive seeds."""
    jobs: Annotated[int | None, optional("N")] = None
    """Parallel processes; default: one per core. The results do not depend on it."""
    out: Annotated[Path | None, optional("DIR")] = None
    """Run folder; default: runs/<UTC stamp>. Finished flights in it are not flown again."""
    plan: Annotated[bool, flag] = False
    """Print the number of flights and their flight time, and stop."""
    json: Annotated[bool, flag] = False
    """Print the summary as one JSON line on standard output, and nothing else."""

    def run(self, words: list[str]) -> int:
        """Fly the missing flights, score all, write table, summary and page."""
        from importlib.metadata import version

        from rich.console import Console

        from sim.fault_matrix.design import NAME, Choice, design, job_scene, pilot_of
        from sim.fault_matrix.page import PARTS, summary, write
        from sim.fault_matrix.verdict import verdicts
        from sim.flight.working import working
        from sim.report.rundir import RunFolder, as_json
        from sim.sweep import run_sweep
        from sim.sweep.progress import sweep_progress

        started = time.perf_counter()
        check_seed(self.seed)
        check_count("--seeds", self.seeds, 1, MOST_SEEDS)
        check_jobs(self.jobs)
        workers = self.jobs or usable_cores()
        choice = Choice(
            quick=self.quick,
            seeds=self.seeds,
            pattern=self.rows,
            world=self.world,
            seed=self.seed,
            unsupervised=self.unsupervised,
            controller=self.controller or "",
        )
        notes, runs = Console(stderr=True, quiet=self.json), design(choice)
        _print_plan(Console() if self.plan else notes, runs, workers)
        if self.plan:
            return 0
        with RunFolder.open(self.out, resume=True) as opened:
            folder = opened.path
            with sweep_progress(notes, NAME) as progress:
                result = run_sweep(runs, folder / PARTS, workers=workers, progress=progress)
            vehicle = pilot_of("supervised").controller.vehicle
            push_n = job_scene(choice.worlds[0]).paint.push_n
            found = verdicts(choice.rows, result.table, push_n, vehicle)
            facts: dict[str, Any] = {
                "command": command_line(words),
                "version": version("ibvs-qp"),
                "quick": self.quick,
                "seed": self.seed,
                "worlds": list(choice.worlds),
                "interrupted": result.interrupted,
                "wall_time_s": time.perf_counter() - started,
            }
            content = summary(found, folder, facts)
            with working(notes, "Writing the page ..."):
                file = write(folder, result.table, content, self._page(found, choice, result.table.height))
            if self.json:
                print(as_json(content))
            else:
                _print_verdicts(Console(), found, choice.worlds)
                print(f"Results: {file}")
            if result.interrupted:
                return interrupted(words, folder, f"finished flights are in {folder}")
            return 0

    def _page(self, found: Sequence[Verdict], choice: Choice, flights: int) -> str:
        from importlib.metadata import version

        from sim.fault_matrix.design import job_scene, pilot_of
        from sim.fault_matrix.page import hovers, page

        vehicle = pilot_of("supervised").controller.vehicle
        left = hovers(choice.rows, {world: job_scene(world) for world in choice.worlds}, vehicle)
        lead = (
            f"{flights} flights of the QP law on geometric features, worlds {' and '.join(choice.worlds)}, first seed "
            f"{self.seed}, {version('ibvs-qp')}."
        )
        lead = ("A quick run with few flights, not the record: " if self.quick else "") + lead
        return page(found, left, lead, self._again(), vehicle)

    def _again(self) -> str:
        """The command that repeats the matrix on any computer."""
        words = ["ibvs-qp", "faults", *(["--quick"] if self.quick else [])]
        words += ["--seeds", str(self.seeds)] if self.seeds else []
        words += ["--rows", self.rows] if self.rows != "*" else []
        words += ["--world", self.world] if self.world else []
        words += ["--unsupervised"] if self.unsupervised else []
        words += ["--seed", str(self.seed)] if self.seed else []
        return shlex.join(words)


def _print_plan(console: Console, runs: Sequence[Run], workers: int) -> None:
    flown_s = sum(run.expected_s for run in runs)
    control = sum(run.variant == "control" for run in runs)
    hours = flown_s / REAL_TIME_FACTOR / workers / 3600.0
    console.print(
        f"faults: {len(runs)} flights, {control} of them without the supervisor, about {flown_s / 60.0:.0f} min of "
        f"flight time; about {hours:.1f} h with {workers} {'process' if workers == 1 else 'processes'}",
        highlight=False,
    )


def _print_verdicts(console: Console, verdicts: Sequence[Verdict], worlds: Sequence[str]) -> None:
    from sim.evaluate.table import terminal_table

    heads = ("fault", "place", "passed", "control fails", "broken")
    rows = []
    for verdict in verdicts:
        flown, control = verdict.flown, verdict.control
        fails = f"{control.n - control.passed} of {control.n}" + (": proves nothing" if verdict.proves_nothing else "")
        passed = f"{flown.passed} of {flown.n}" + ("" if verdict.met else ": NO")
        how = flown.how if flown.n else control.how
        rows.append((verdict.row.name, verdict.place, passed if flown.n else "–", fails, "; ".join(how)))
    console.print(terminal_table(heads, rows, f"Fault matrix, world {' and '.join(worlds)}", text=heads))
