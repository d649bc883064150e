"""Signs of work on standard error: a spinner on a terminal; elsewhere, as in a file, lines of text."""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn

if TYPE_CHECKING:
    from sim.world.scene import Scene

#: Time to the first line and between two [s]: together less than 10 s, as one kind of work follows another. The line of
#: an error in an option or a file comes before the first.
FIRST_S, PERIOD_S = 3.0, 6.0


@contextlib.contextmanager
def lines(console: Console, state: Callable[[], str]) -> Iterator[None]:
    """Write the state of some work after `FIRST_S` and every `PERIOD_S` while the context is open, by a thread.

    Args:
        console: Output, whose descriptor is no terminal; a quiet one gets nothing.
        state: The present state, in one line.
    """
    over = threading.Event()
    thread = threading.Thread(target=write, args=(console, state, over.wait), name="progress", daemon=True)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()


def write(
    console: Console,
    state: Callable[[], str],
    over: Callable[[float], bool],
    clock: Callable[[], float] = time.monotonic,
) -> None:
    """Write lines until the work is over.

    Args:
        console: Output.
        state: The present state.
        over: Waits for the end of the work, at most so long [s], and returns whether it came.
        clock: Monotonic time [s].
    """
    started, pause = clock(), FIRST_S
    while not over(pause):
        pause = PERIOD_S
        if not console.quiet:
            with contextlib.suppress(OSError, ValueError):  # a closed output must not end the work
                print(f"{state()} ({clock() - started:.0f} s)", file=console.file, flush=True)


@contextlib.contextmanager
def working(console: Console, text: str) -> Iterator[Callable[[str], None]]:
    """Show the present work while the context is open.

    Args:
        console: Standard error.
        text: Name of the work.

    Yields:
        A function that replaces the text.
    """
    if console.is_terminal:
        with console.status(text) as status:
            yield status.update
        return
    shown = {"text": text}
    with lines(console, lambda: shown["text"]):
        yield lambda new: shown.update(text=new)


#: Flying time that does not grow with the job: approach, alignment, press, retreat [s]; only sizes the bar.
OVERHEAD_S = 25.0


@contextlib.contextmanager
def flight_progress(
    console: Console, scene: Scene, laws: tuple[str, ...]
) -> Iterator[Callable[[str, float, str, float], None]]:
    """Show every law while the context is open.

    Yields:
        A function of law, simulated time [s], phase and real-time factor.
    """
    # Here, since the first line of a command must not wait for them.
    from sim.flight.jobs import PaintJob
    from sim.flight.options import FlightOptions, pilot_config
    from sim.flight.trace import law_name
    from sim.world.board import BoardGeometry

    notes = dict.fromkeys(laws, "starting")
    if not console.is_terminal:
        with lines(console, lambda: "; ".join(f"{law_name(law)}: {note}" for law, note in notes.items())):
            yield lambda law, *now: notes.update({law: _note(*now)})
        return
    columns = (
        TextColumn("{task.description:<12}"),
        BarColumn(),
        TaskProgressColumn(),
        TextColumn("{task.fields[note]}"),
    )
    total = (
        PaintJob().expected_s(pilot_config(scene, FlightOptions()).painting, BoardGeometry(scene).strokes) + OVERHEAD_S
    )
    with Progress(*columns, console=console, disable=console.quiet) as bars:
        tasks = {law: bars.add_task(law_name(law), total=total, note="starting") for law in laws}

        def update(law: str, t: float, phase: str, rtf: float) -> None:
            done = phase == "done"
            bars.update(
                tasks[law],
                completed=total if done else min(t, 0.99 * total),
                note=_note(t, phase, rtf),
            )

        yield update


def _note(t: float, phase: str, rtf: float) -> str:
    return f"{t:5.1f} s  {phase:<9} {rtf:4.1f} x real time"
