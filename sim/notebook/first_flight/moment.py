"""One tick in detail: what the camera saw, what the rotors did, what every task asked and got."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from allocation import TAROT_T960
from sim.evaluate.explanation import explain_tick
from sim.figures.style import law_colour, new_figure
from sim.flight.trace import Trace
from sim.notebook.first_flight.figures import nearest_picture, show_picture

#: Tasks that only regularise; they are left out of the table.
REGULAR = ("effort", "smooth")


def _tick(trace: Trace, time_s: float) -> int:
    return int(np.clip(np.searchsorted(trace.t, time_s), 0, len(trace.t) - 1))


def draw_moment(trace: Trace, time_s: float) -> Figure:
    """The camera's picture nearest to a moment, beside the rotor thrusts between their limits."""
    tick = _tick(trace, time_s)
    figure = new_figure(2.9)
    left, right = figure.subplots(1, 2, width_ratios=[1.15, 1.0])
    show_picture(left, nearest_picture(trace, time_s), trace.phases[int(trace.phase[tick])])
    _draw_thrusts(right, trace, tick)
    return figure


def _draw_thrusts(axes: Axes, trace: Trace, tick: int) -> None:
    rotors = np.arange(trace.thrusts.shape[1])
    axes.barh(rotors, trace.thrusts[tick], color=law_colour(trace.law), height=0.55)
    for limit in (trace.thrust_min, trace.thrust_max):
        axes.vlines(limit, rotors - 0.4, rotors + 0.4, color="#b3261e", linewidth=1.1)
    names = [name.replace("_", " ") for name in TAROT_T960.names]
    axes.set_yticks(rotors, names if len(names) == len(rotors) else [f"rotor {rotor + 1}" for rotor in rotors])
    axes.set(title="thrusts between their limits", xlabel="thrust [N]")
    axes.invert_yaxis()
    axes.grid(visible=False, axis="y")


def moment_text(trace: Trace, time_s: float) -> str:
    """The program of a tick, solved again: tasks, limits and what was given up, as markdown."""
    tick = _tick(trace, time_s)
    _, explained = explain_tick(trace, tick)
    if explained is None:
        return f"At {trace.t[tick]:.3f} s the program had no solution."
    head = (
        f"**t = {trace.t[tick]:.3f} s**, push {trace.push_measured[tick]:.2f} N of {trace.push_reference[tick]:.2f} N "
        f"asked, λ = {trace.contact_weight[tick]:.2f}, outcome: {trace.outcomes[int(trace.outcome[tick])]}"
    )
    lines = [head, "", "| task | unit | asked | does | weight |", "|:--|:--|--:|--:|--:|"]
    for task in explained.tasks:
        if not task.name.startswith(REGULAR):
            name, numbers = task.name.replace("_", " "), f"{task.asked:+.3f} | {task.achieved:+.3f} | {task.weight:.3g}"
            lines.append(f"| {name} | {task.unit} | {numbers} |")
    limits = "; ".join(
        f"{limit.name.replace('_', ' ')} ({limit.side}) at a price of {limit.price:.3g} per {limit.unit}"
        for limit in explained.active_limits
    )
    return "\n".join([*lines, "", f"Active limits: {limits or 'none'}."])
