"""Notebook 01: one flight from the camera's picture to the painted board, and any tick of it in detail."""

from __future__ import annotations

import functools

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from allocation import TAROT_T960
from sim.evaluate.explanation import explain_tick
from sim.evaluate.explanation_text import TASK_HEADINGS, task_rows
from sim.experiments.scenes import changed, short_job
from sim.figures.style import law_colour, new_figure
from sim.flight.closed_loop import fly
from sim.flight.options import FlightOptions
from sim.flight.pictures import unpack_picture
from sim.flight.trace import Trace
from sim.notebook.common import RED, table, unless_short
from sim.world.scene import Scene

#: Camera pictures shown: phase, and fraction of its duration.
MOMENTS = (("approach", 0.5), ("press", 0.7), ("paint", 0.35), ("paint", 0.9))
#: Stroke [m] and picture size [px] of the short form.
SHORT_STROKE_M, SHORT_SIZE = 0.12, (424, 240)


@functools.lru_cache(maxsize=4)
def fly_first(seed: int = 0, push_n: float = 5.0, slope_deg: float = 0.0) -> Trace:
    """Paint the C of two rows from rendered pictures under the QP law; results are cached.

    Args:
        seed: Of start pose, textures, clutter, noise and biases.
        push_n: Push reference [N].
        slope_deg: Rotation of the board in its own plane [deg].
    """
    scene = unless_short(Scene(), short_job(SHORT_STROKE_M, rows=1))
    scene = changed(scene, paint={"push_n": push_n}, board={"slope_deg": slope_deg})
    return fly(scene, FlightOptions(seed=seed, image_size=unless_short(None, SHORT_SIZE)))


def draw_camera(trace: Trace) -> Figure:
    """Camera pictures of approach, press and paint, with the detected lines."""
    figure = new_figure(5.9)
    for axes, (phase, fraction) in zip(figure.subplots(2, 2).ravel(), MOMENTS, strict=True):
        ticks = np.flatnonzero(trace.phase == trace.phases.index(phase))
        _show_picture(axes, trace, float(trace.t[ticks[int(fraction * (len(ticks) - 1))]]) if len(ticks) else None)
    return figure


def _show_picture(axes: Axes, trace: Trace, time_s: float | None) -> None:
    """Show the recorded picture nearest to a time."""
    axes.set_axis_off()
    if time_s is None or not trace.pictures:
        axes.set_title("no picture")
        return
    when, packed, phase = min(trace.pictures, key=lambda entry: abs(entry[0] - time_s))
    axes.imshow(unpack_picture(packed))
    axes.set_title(f"{when:.1f} s, {phase}")


def tick_at(trace: Trace, time_s: float) -> int:
    """Index of the tick at a time."""
    return int(np.clip(np.searchsorted(trace.t, time_s), 0, len(trace.t) - 1))


def draw_moment(trace: Trace, time_s: float) -> Figure:
    """Camera picture nearest to a moment, and the rotor thrusts between their limits."""
    figure = new_figure(2.9)
    left, right = figure.subplots(1, 2, width_ratios=[1.15, 1.0])
    _show_picture(left, trace, time_s)
    rotors = np.arange(trace.thrusts.shape[1])
    right.barh(rotors, trace.thrusts[tick_at(trace, time_s)], color=law_colour(trace.law), height=0.55)
    for limit in (trace.thrust_min, trace.thrust_max):
        right.vlines(limit, rotors - 0.4, rotors + 0.4, color=RED, linewidth=1.1)
    right.set_yticks(rotors, [name.replace("_", " ") for name in TAROT_T960.names])
    right.set(title="thrusts between their limits", xlabel="thrust [N]")
    right.invert_yaxis()
    right.grid(visible=False, axis="y")
    return figure


def moment_text(trace: Trace, time_s: float) -> str:
    """Tasks and active limits of one tick as markdown; its program is solved again."""
    tick = tick_at(trace, time_s)
    _, explained = explain_tick(trace, tick)
    if explained is None:
        return f"At {trace.t[tick]:.3f} s the program had no solution."
    tasks = table(TASK_HEADINGS, task_rows(explained), left=2)
    limits = "; ".join(
        f"{limit.name.replace('_', ' ')} ({limit.side}), multiplier {limit.price:.3g} per {limit.unit}"
        for limit in explained.active_limits
    )
    return (
        f"**t = {trace.t[tick]:.3f} s**, push {trace.push_measured[tick]:.2f} N, reference "
        f"{trace.push_reference[tick]:.2f} N, λ = {trace.contact_weight[tick]:.2f}, outcome: "
        f"{trace.outcomes[int(trace.outcome[tick])]}\n\n{tasks}\n\nActive limits: {limits or 'none'}."
    )
