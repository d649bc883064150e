"""``ibvs-qp bench``: times of a control tick, a picture or a whole flight, and ratios to rivals within one run."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import tyro

from sim.commands.options import check_count, check_seed, flag, optional

if TYPE_CHECKING:
    from sim.bench.timing import Bench as BenchResult


@dataclasses.dataclass(frozen=True, kw_only=True)
class Bench:
    """Measure the processor time of a control tick or a picture in one thread; rivals are warmed up in the same run.

    Example: ibvs-qp bench qp --json
    """

    what: tyro.conf.Positional[Literal["qp", "vision", "loop"]]
    """Measure a control tick (qp), a picture (vision) or the stages of a short flight (loop)."""
    ticks: int = 100_000
    """bench qp: recorded ticks of closed loops."""
    sample: int = 50
    """bench qp: rivals solve every n-th tick."""
    frames: int = 160
    """bench vision: rendered pictures per size; the first 12 warm up."""
    real: Annotated[Path | None, optional("DIR")] = None
    """bench vision: folder of real RGB-D frames with a manifest.csv; default: rendered frames only."""
    seed: int = 0
    """Varies textures, clutter and noise of the rendered pictures."""
    json: Annotated[bool, flag] = False
    """Print one JSON line on standard output, and nothing else."""

    def run(self, words: list[str]) -> int:
        """Measure and print."""
        from rich.console import Console

        from sim.flight.working import working
        from sim.report.rundir import as_json

        check_seed(self.seed)
        check_count("--frames", self.frames, 20, 5000)
        check_count("--ticks", self.ticks, 1000, 10_000_000)
        check_count("--sample", self.sample, 1, 10_000)
        notes = Console(stderr=True, quiet=self.json)
        with working(notes, "Measuring ...") as update:
            bench = self._measure(lambda text: update(f"Measuring {text} ..."))
        if self.json:
            print(as_json(bench.summary()))
        elif self.what == "loop":
            _show_loop(bench)
        else:
            _show(bench)
        return 0

    def _measure(self, progress: Callable[[str], None]) -> BenchResult:
        if self.what == "qp":
            from sim.bench.qp import bench_qp

            return bench_qp(self.ticks, self.seed, self.sample, progress)
        if self.what == "loop":
            from sim.bench.loop import bench_loop

            return bench_loop(self.seed, progress)
        from sim.bench.vision import bench_vision

        return bench_vision(self.frames, self.seed, self.real, progress)


def _show_loop(bench: BenchResult) -> None:
    """Print where a flown second goes, one column per flight."""
    from rich.console import Console

    from sim.bench.loop import STAGES
    from sim.evaluate.table import terminal_table

    columns = {key.removesuffix("_real_time"): factor for key, factor in bench.ratios.items()}
    rows = [(s, *(f"{1e-3 * bench.stages_us[f'{flight}_{s}']:.1f}" for flight in columns)) for s in STAGES]
    rows.append(("real-time factor", *(f"{factor:.1f}" for factor in columns.values())))
    Console().print(terminal_table(("stage", *columns), rows, "Wall-clock time per flown second, in ms"))


def _show(bench: BenchResult) -> None:
    """Print the tables for the terminal."""
    from rich.console import Console

    from sim.evaluate.table import terminal_table

    figures = [row.summary() for row in bench.rows]
    sized = any(figure["size"] for figure in figures)
    unit, name, digits = (1e-3, "ms", 2) if sized else (1.0, "us", 1)
    headings = ("measured", *(("size",) if sized else ()), "median", "90 %", "99 %", "99.9 %", "max", "> 4/2/1 ms")
    rows = []
    for figure in figures:
        times = (f"{unit * figure[key]:.{digits}f}" for key in ("p50_us", "p90_us", "p99_us", "p999_us", "max_us"))
        size = (figure["size"] or "",) if sized else ()
        rows.append((figure["name"], *size, *times, "/".join(map(str, figure["misses"].values()))))
    console = Console()
    console.print(terminal_table(headings, rows, f"Processor time, one thread [{name}]", text=("measured", "size")))
    stages = ", ".join(f"{stage} {unit * time_us:.2f}" for stage, time_us in bench.stages_us.items())
    console.print(f"Medians of the stages [{name}]: {stages}")
    for rival, ratio in bench.ratios.items():
        console.print(f"{rival}: {ratio:.1f} x our median")
    for key, note in bench.notes.items():
        console.print(f"{key}: {note}")
