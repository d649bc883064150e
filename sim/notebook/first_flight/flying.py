"""The flight of the first notebook: the main job with rendered pictures, or a short stroke in the short form."""

from __future__ import annotations

import functools

from sim.experiments.scenes import changed, short_job
from sim.flight.closed_loop import FlightOptions, fly
from sim.flight.trace import Trace
from sim.notebook.short import unless_short
from sim.world.scene import Scene

#: Stroke of the short form [m], and its pictures [px].
SHORT_STROKE_M, SHORT_SIZE = 0.12, (424, 240)


@functools.lru_cache(maxsize=4)
def fly_first(seed: int = 0, push_n: float = 5.0, slope_deg: float = 0.0) -> Trace:
    """Paint the C of two rows from rendered pictures under the quadratic program.

    Args:
        seed: Start pose, textures, clutter, noise and biases.
        push_n: Push asked for [N].
        slope_deg: Turn of the board in its own plane [deg].

    Returns:
        The flight; asked for again it is the one flown before.
    """
    scene = unless_short(Scene(), short_job(SHORT_STROKE_M, rows=1))
    scene = changed(scene, paint={"push_n": push_n}, board={"slope_deg": slope_deg})
    size = unless_short(None, SHORT_SIZE)
    options = FlightOptions(seed=seed, image_size=size)
    return fly(scene, options)


def story(trace: Trace) -> str:
    """Events of a flight in order, as a markdown table."""
    lines = ["| time | | |", "|--:|:--|:--|"]
    lines += [f"| {event.t:.2f} s | {event.kind} | {event.text} |" for event in trace.events]
    return "\n".join(lines)
