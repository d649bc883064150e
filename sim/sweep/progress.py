"""Progress of a sweep on standard error: flights done, time passed, time left."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from sim.sweep.engine import SweepProgress

#: Flights over which the speed is averaged for the time left [s]: long enough to see several flights of each kind.
_SPEED_PERIOD_S = 300.0


@contextlib.contextmanager
def sweep_progress(console: Console, title: str) -> Iterator[SweepProgress]:
    """Show a bar while the context is open.

    Yields:
        A function of runs finished, all runs, and how many were on disk already.
    """
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
        TextColumn("{task.fields[note]}"),
    )
    with Progress(*columns, console=console, disable=console.quiet, speed_estimate_period=_SPEED_PERIOD_S) as bars:
        task = bars.add_task(title, total=None, note="")

        def update(done: int, count: int, reused: int) -> None:
            # What was on disk already took no time and says nothing about the time left.
            note = f"({reused} on disk already)" if reused else ""
            bars.update(task, completed=done - reused, total=count - reused, note=note)

        yield update
