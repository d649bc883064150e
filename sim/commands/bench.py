"""``ibvs-qp bench``: what vision costs beside its rivals, as ratios within one run."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

if TYPE_CHECKING:
    from sim.bench.timing import Bench as BenchResult

_flag = tyro.conf.arg(help_behavior_hint="")


def _optional(metavar: str) -> Any:
    """Help text of an option whose default is worded in its description."""
    return tyro.conf.arg(metavar=metavar, help_behavior_hint="")


@dataclasses.dataclass(frozen=True, kw_only=True)
class Bench:
    """Measure what a picture costs, one thread, rivals warmed and in turn in the same run.

    Example: ibvs-qp bench vision --real frames/board --json
    """

    what: tyro.conf.Positional[Literal["vision"]]
    """What is measured: vision."""
    frames: int = 160
    """Rendered pictures per size; the first 12 warm up."""
    real: Annotated[Path | None, _optional("DIR")] = None
    """Folder of real RGB-D frames with a manifest.csv; default: rendered frames only."""
    seed: int = 0
    """Varies textures, clutter and noise of the rendered pictures."""
    json: Annotated[bool, _flag] = False
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

        from ibvs_qp.errors import IbvsQpError
        from sim.bench.vision import bench_vision
        from sim.checks import check_seed
        from sim.rundir import as_json

        check_seed(self.seed)
        if not LEAST_FRAMES <= self.frames <= MOST_FRAMES:
            raise IbvsQpError(f"--frames {self.frames} is refused: allowed is {LEAST_FRAMES} to {MOST_FRAMES}")
        notes = Console(stderr=True, quiet=self.json)
        with notes.status("Measuring ...") as status:
            bench = bench_vision(self.frames, self.seed, self.real, lambda text: status.update(f"Measuring {text} ..."))
        if self.json:
            print(as_json(bench.summary()))
        else:
            _show(bench)
        return 0


#: Fewest and most pictures per size.
LEAST_FRAMES, MOST_FRAMES = 20, 5000


def _show(bench: BenchResult) -> None:
    """Print the tables for people."""
    from rich.console import Console
    from rich.table import Table

    table = Table("measured", "size", "median", "90 %", "99 %", "most", title="Processor time, one thread [ms]")
    for row in bench.rows:
        figures = row.summary()
        cells = (figures["p50_us"], figures["p90_us"], figures["p99_us"], figures["max_us"])
        table.add_row(row.name, row.size or "", *(f"{1e-3 * cell:.2f}" for cell in cells))
    console = Console()
    console.print(table)
    stages = ", ".join(f"{name} {1e-3 * time_us:.2f}" for name, time_us in bench.stages_us.items())
    console.print(f"Stages, medians [ms]: {stages}")
    for name, ratio in bench.ratios.items():
        console.print(f"{name}: {ratio:.1f}")
