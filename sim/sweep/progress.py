"""Progress of a sweep on standard error: finished flights, time passed, time left by the expected flying time."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from sim.flight.working import lines

#: Period of the speed average for the time left [s]: long enough for several flights of each kind.
_SPEED_PERIOD_S = 300.0


@contextlib.contextmanager
def sweep_progress(console: Console, title: str) -> Iterator[Callable[..., None]]:
    """Show finished runs while the context is open, on a terminal with a bar.

    Yields:
        Function of finished runs, all runs, runs already on disk, and the finished fraction of the others' expected
        flying time; without it the counts move the bar.
    """
    if not console.is_terminal:
        state = {"counted": ""}
        with lines(console, lambda: f"{title}: {state['counted'] or 'starting'}"):
            yield lambda done, count, reused, _=None: state.update(counted=" ".join(_counted(done, count, reused)))
        return
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.fields[count]}"),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
        TextColumn("{task.fields[note]}"),
    )
    with Progress(*columns, console=console, disable=console.quiet, speed_estimate_period=_SPEED_PERIOD_S) as bars:
        task = bars.add_task(title, total=None, count="", note="")

        def update(done: int, count: int, reused: int, fraction: float | None = None) -> None:
            # Runs already on disk took no time and do not count in the time left.
            flown, planned = done - reused, count - reused
            finished = flown / planned if fraction is None and planned else fraction
            counted, note = _counted(done, count, reused)
            bars.update(task, completed=finished, total=1.0, count=counted, note=note)

        yield update


def _counted(done: int, count: int, reused: int) -> tuple[str, str]:
    """Finished of all runs to fly, and a note on those that were on disk."""
    return f"{done - reused}/{count - reused}", f"({reused} on disk already)" if reused else ""
