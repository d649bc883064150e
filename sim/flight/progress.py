"""Progress of the flights on standard error: phase and real-time factor per law, on a terminal with a bar."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn

from sim.flight.jobs import PaintJob
from sim.flight.options import FlightOptions, pilot_config
from sim.flight.trace import law_name
from sim.flight.working import lines
from sim.world.board import BoardGeometry
from sim.world.scene import Scene

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
