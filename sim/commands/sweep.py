"""``ibvs-qp sweep``: fly a grid or random design on this computer or a cluster, and report the results."""

from __future__ import annotations

import contextlib
import dataclasses
import time
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from sim.commands.options import (
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

    from sim.sweep import Planned, SweepResult
    from sim.sweep.engine import Pool

PARTS = "parts"


@dataclasses.dataclass(frozen=True, kw_only=True)
class Sweep:
    """Fly a grid or random design over scene, vehicle, noise and controller parameters; docs/sweeps.md defines specs.

    Example: ibvs-qp sweep sim/sweep/specs/friction_mass.toml --out runs/friction

    Draw again: ibvs-qp sweep --report runs/friction
    """

    spec: Annotated[Path | None, tyro.conf.Positional, optional("SPEC")] = None
    """The design (TOML)."""
    report: Annotated[Path | None, optional("DIR_OR_PARQUET")] = None
    """Fly nothing: draw box plots, heat maps and success-rate maps of an existing table."""
    figures: Annotated[tuple[str, ...], optional("COLUMN ...")] = ()
    """Columns to report; default: path, push, tilt and thrust rate."""
    jobs: Annotated[int | None, optional("N")] = None
    """Parallel processes; default: one per core. The table does not depend on it."""
    dask: Annotated[bool, flag] = False
    """Fly on a local Dask cluster, started for this sweep."""
    scheduler: Annotated[str | None, optional("ADDRESS")] = None
    """Fly on the Dask cluster of this scheduler, such as tcp://head:8786."""
    seed: Annotated[int | None, optional("N")] = None
    """First seed; default: the spec's."""
    out: Annotated[Path | None, optional("DIR")] = None
    """Run folder; default: runs/<UTC stamp>. Finished blocks in it are not flown again."""
    plan: Annotated[bool, flag] = False
    """Print the number of flights and their flight time, and stop."""
    json: Annotated[bool, flag] = False
    """Print one line of JSON on standard output, and nothing else."""

    def run(self, words: list[str]) -> int:
        """Fly the missing flights and report them, or report an existing table."""
        from rich.console import Console

        from ibvs_qp.config.errors import ConfigError

        if (self.spec is None) == (self.report is None):
            raise ConfigError("give either a spec to fly or --report with a table to draw (see ibvs-qp sweep --help)")
        if self.report is not None:
            return self._report(self.report)
        notes = Console(stderr=True, quiet=self.json)
        return self._fly(words, notes)

    def _report(self, path: Path) -> int:
        from rich.console import Console

        from sim.flight.working import working
        from sim.report.rundir import RunFolder, as_json
        from sim.sweep.figures import write_report
        from sim.sweep.figures.page import read_table

        table, folder = read_table(path)
        title = f"Sweep {path.stem if path.is_file() else path.name}"
        notes = Console(stderr=True, quiet=self.json)
        with RunFolder.open(self.out or folder, resume=True) as out, working(notes, "Drawing the report ..."):
            page = write_report(table, out.path, title, self.figures)
        print(as_json({"schema": 1, "report": str(page), "flights": table.height}) if self.json else f"Report: {page}")
        return 0

    def _fly(self, words: list[str], notes: Console) -> int:
        from sim.report.rundir import RunFolder

        started, design = time.perf_counter(), self._design()
        _print_plan(notes if not self.plan else type(notes)(), design)
        if self.plan:
            return 0
        with RunFolder.open(self.out, resume=True) as folder:
            return self._fly_into(folder.path, design, words, started, notes)

    def _fly_into(self, folder: Path, design: Planned, words: list[str], started: float, notes: Console) -> int:
        from sim.flight.working import working
        from sim.report.rundir import as_json, write_json
        from sim.storage.atomic import write_text
        from sim.sweep import run_sweep
        from sim.sweep.figures import write_report
        from sim.sweep.parts import write_table
        from sim.sweep.progress import sweep_progress

        settings = design.spec.settings
        with self._pool(notes) as pool, sweep_progress(notes, settings.name) as progress:
            result = run_sweep(
                design,
                folder / PARTS,
                workers=self.jobs or usable_cores(),
                block_runs=settings.block_runs,
                progress=progress,
                pool=pool,
            )
        assert self.spec is not None
        if self.spec.resolve() != (folder / "spec.toml").resolve():
            write_text(folder / "spec.toml", self.spec.read_text(encoding="utf-8"))
        table = folder / f"{settings.name}.parquet"
        write_table(table, result.table)
        page = None
        if result.table.height and not result.interrupted:
            with working(notes, "Drawing the report ..."):
                page = write_report(
                    result.table, folder, f"Sweep {settings.name}, world {design.spec.world}", self.figures
                )
        content = {
            "schema": 1,
            "command": command_line(words),
            **_facts(design, result),
            "data_file": str(table),
            "run_dir": str(folder),
            "report": str(page) if page else None,
            "wall_time_s": time.perf_counter() - started,
        }
        write_json(folder / "sweep.json", content)
        if self.json:
            print(as_json(content))
        elif page is not None:
            print(f"{content['completed']} of {content['flights']} flights ended as planned. Report: {page}")
            if content["false_claims"]:
                print(f"{content['false_claims']} more were claimed by the pilot: false claims.")
        if result.interrupted:
            return interrupted(words, folder, f"finished blocks are in {folder}")
        return 0

    def _design(self) -> Planned:
        from ibvs_qp.config.errors import ConfigError
        from sim.sweep import Planned, load_spec

        check_jobs(self.jobs)
        if self.dask and self.scheduler:
            raise ConfigError("--dask starts a local cluster and --scheduler uses a running one; give one of them")
        assert self.spec is not None
        spec = load_spec(self.spec)
        if self.seed is not None:
            check_seed(self.seed)
            spec = dataclasses.replace(spec, settings=dataclasses.replace(spec.settings, seed=self.seed))
        return Planned(spec)

    @contextlib.contextmanager
    def _pool(self, notes: Console) -> Iterator[Pool | None]:
        if not (self.dask or self.scheduler):
            yield None
            return
        from sim.flight.working import working
        from sim.sweep.engine import cluster_pool

        with contextlib.ExitStack() as stack:
            with working(notes, "Waiting for the cluster ..."):
                pool = stack.enter_context(cluster_pool(self.scheduler, self.jobs or usable_cores()))
            yield pool


def _facts(design: Planned, result: SweepResult) -> dict[str, object]:
    from sim.sweep.statistics import false_claims

    failed = result.table.filter(~result.table["completed"])
    reasons = failed["reason"].value_counts(sort=True, name="n").rows()
    return {
        "name": design.spec.settings.name,
        "planned": len(design),
        "flights": result.table.height,
        "completed": int(result.table["completed"].sum()),
        "false_claims": false_claims(result.table),
        "failed": {str(reason): count for reason, count in sorted(reasons, key=lambda row: (-row[1], str(row[0])))},
        "on_disk_before": result.reused,
        "interrupted": result.interrupted,
    }


def _print_plan(console: Console, design: Planned) -> None:
    from sim.sweep.design import Run

    settings, first = design.spec.settings, design.run(0)
    blocks = -(-len(design) // settings.block_runs)
    air = f", about {len(design) * first.expected_s / 60.0:.0f} min of flight time" if isinstance(first, Run) else ""
    varied = ", ".join(axis.path for axis in (*design.spec.grid, *design.spec.random)) or "seeds only"
    console.print(
        f"{settings.name}: {len(design)} flights in {blocks} blocks{air}; world {design.spec.world}; varied: {varied}",
        soft_wrap=True,
        highlight=False,
    )
