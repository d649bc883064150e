"""``ibvs-qp bench``: what a tick or a picture costs beside its rivals, and where a flown second goes."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import tyro

from sim.commands.options import flag, optional

if TYPE_CHECKING:
    from sim.bench.timing import Bench as BenchResult


@dataclasses.dataclass(frozen=True, kw_only=True)
class Bench:
    """Measure what a control tick or a picture costs, one thread, rivals warmed and in the same run.

    Example: ibvs-qp bench qp --json
    """

    what: tyro.conf.Positional[Literal["qp", "vision", "loop"]]
    """What is measured: a control tick, a picture, or the stages of a short flight."""
    ticks: int = 100_000
    """bench qp: recorded ticks of closed loops."""
    sample: int = 50
    """bench qp: rivals see every so many-th tick."""
    frames: int = 160
    """bench vision: rendered pictures per size; the first 12 warm up."""
    real: Annotated[Path | None, optional("DIR")] = None
    """bench vision: folder of real RGB-D frames with a manifest.csv; default: rendered frames only."""
    seed: int = 0
    """Varies textures, clutter and noise of the rendered pictures."""
    json: Annotated[bool, flag] = False
    """Print one JSON line on standard output, and nothing else."""

    def run(self, words: list[str]) -> int:
        """Measure and print.

        Args:
            words: The command line.

        Returns:
            0.

        Raises:
            IbvsQpError: When an option is refused.
        """
        from rich.console import Console

        from ibvs_qp.config.errors import IbvsQpError
        from sim.commands.checks import check_seed
        from sim.report.rundir import as_json

        check_seed(self.seed)
        if not LEAST_FRAMES <= self.frames <= MOST_FRAMES:
            raise IbvsQpError(f"--frames {self.frames} is refused: allowed is {LEAST_FRAMES} to {MOST_FRAMES}")
        notes = Console(stderr=True, quiet=self.json)
        for option, value, low, high in (
            ("--ticks", self.ticks, 1000, 10_000_000),
            ("--sample", self.sample, 1, 10_000),
        ):
            if not low <= value <= high:
                raise IbvsQpError(f"{option} {value} is refused: allowed is {low} to {high}")
        with notes.status("Measuring ...") as status:
            bench = self._measure(lambda text: status.update(f"Measuring {text} ..."))
        if self.json:
            print(as_json(bench.summary()))
        elif self.what == "loop":
            _show_loop(bench)
        else:
            _show(bench)
        return 0

    def _measure(self, tell: Callable[[str], None]) -> BenchResult:
        if self.what == "qp":
            from sim.bench.qp import bench_qp

            return bench_qp(self.ticks, self.seed, self.sample, tell)
        if self.what == "loop":
            from sim.bench.loop import bench_loop

            return bench_loop(self.seed, tell)
        from sim.bench.vision import bench_vision

        return bench_vision(self.frames, self.seed, self.real, tell)


#: Fewest and most pictures per size.
LEAST_FRAMES, MOST_FRAMES = 20, 5000


def _show_loop(bench: BenchResult) -> None:
    """Print where a flown second goes, one column per flight."""
    from rich.console import Console
    from rich.table import Table

    from sim.bench.loop import STAGES

    table = Table("stage", title="Wall-clock time per flown second, in ms")
    columns = {key.removesuffix("_real_time"): factor for key, factor in bench.ratios.items()}
    for flight in columns:
        table.add_column(flight, justify="right")
    for stage in STAGES:
        table.add_row(stage, *(f"{1e-3 * bench.stages_us[f'{flight}_{stage}']:.1f}" for flight in columns))
    table.add_row("real-time factor", *(f"{factor:.1f}" for factor in columns.values()))
    Console().print(table)


def _show(bench: BenchResult) -> None:
    """Print the tables for people."""
    from rich.console import Console
    from rich.table import Table

    figures = [row.summary() for row in bench.rows]
    sized = any(figure["size"] for figure in figures)
    unit, name = (1e-3, "ms") if sized else (1.0, "us")
    table = Table(title=f"Processor time, one thread, in {name}")
    table.add_column("measured", no_wrap=True)
    if sized:
        table.add_column("size", no_wrap=True)
    for column in ("median", "90 %", "99 %", "99.9 %", "most", "> 4/2/1 ms"):
        table.add_column(column, justify="right", no_wrap=True)
    for figure in figures:
        cells = (figure[key] for key in ("p50_us", "p90_us", "p99_us", "p999_us", "max_us"))
        texts = (f"{unit * cell:.{2 if sized else 1}f}" for cell in cells)
        size = (figure["size"] or "",) if sized else ()
        misses = "/".join(str(count) for count in figure["misses"].values())
        table.add_row(figure["name"], *size, *texts, misses)
    console = Console()
    console.print(table)
    stages = ", ".join(f"{stage} {unit * time_us:.2f}" for stage, time_us in bench.stages_us.items())
    console.print(f"Stages, medians in {name}: {stages}")
    for rival, ratio in bench.ratios.items():
        console.print(f"{rival}: {ratio:.1f} x our median")
    for what, note in bench.notes.items():
        console.print(f"{what}: {note}")
