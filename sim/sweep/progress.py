"""Progress of a sweep on standard error: flights done, time passed, time left by the flying time still expected."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeElapsedColumn, TimeRemainingColumn

#: Flights over which the speed is averaged for the time left [s]: long enough to see several flights of each kind.
_SPEED_PERIOD_S = 300.0


class SweepBar:
    """The bar: call it with runs finished, all runs, and how many were on disk already.

    Args:
        bars: What draws it.
        task: Its place there.
    """

    def __init__(self, bars: Progress, task: TaskID) -> None:
        self._bars, self._task, self._timed = bars, task, False

    def __call__(self, done: int, count: int, reused: int) -> None:
        """Show counts; they move the bar unless `timed` does."""
        # What was on disk already took no time and says nothing about the time left.
        flown, wanted = done - reused, count - reused
        note = f"({reused} on disk already)" if reused else ""
        self._bars.update(self._task, count=f"{flown}/{wanted}", note=note)
        if not self._timed:
            self._bars.update(self._task, completed=flown, total=wanted)

    def timed(self, flown_s: float, all_s: float) -> None:
        """Move the bar, and with it the time left, by expected flying time: flights differ in length."""
        self._timed = True
        self._bars.update(self._task, completed=flown_s, total=all_s)


@contextlib.contextmanager
def sweep_progress(console: Console, title: str) -> Iterator[SweepBar]:
    """Show a bar while the context is open.

    Yields:
        The bar; call it with runs finished, all runs, and how many were on disk already.
    """
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
        yield SweepBar(bars, bars.add_task(title, total=None, count="", note=""))
