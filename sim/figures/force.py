"""Push force of every law and its reference; the first touch enlarged."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from sim.evaluate.window import CONTACT_N, PHYSICS_RATE_HZ
from sim.figures.style import FAINT, REFERENCE, law_colour, legend_above, new_figure, note_empty, shade_phases, thin
from sim.flight.trace import Trace, law_name

#: Time before and after the first touch in the enlarged view [s].
BEFORE_TOUCH_S, AFTER_TOUCH_S = 0.3, 2.7


def draw_force(traces: dict[str, Trace]) -> Figure:
    """One row per law: whole flight on the left, first touch on the right."""
    figure = new_figure(0.3 + 1.95 * len(traces))
    grid = figure.subplots(len(traces), 2, squeeze=False, sharey=True, gridspec_kw={"width_ratios": [3.2, 1]})
    # The scale follows the commanded push and widens for a harder first touch.
    commanded = max(float(np.max(trace.push_reference, initial=1.0)) for trace in traces.values())
    greatest = max(float(np.max(trace.contact_1khz, initial=0.0)) for trace in traces.values())
    for (flight, touch), (law, trace) in zip(grid, traces.items(), strict=True):
        t, true, measured, reference = thin(trace.t, trace.push_true, trace.push_measured, trace.push_reference)
        shade_phases(flight, trace)
        flight.plot(t, measured, color=FAINT, linewidth=0.7, label="measured")
        flight.plot(t, true, color=law_colour(law), label="true")
        flight.plot(t, reference, **REFERENCE, label="reference")
        flight.set(title=law_name(law), ylabel="push [N]")
        flight.set_ylim(-0.08 * commanded, max(1.45 * commanded, 1.15 * greatest))
        _draw_touch(touch, trace, law)
    legend_above(grid[0][0])
    grid[0][1].set_title("first touch")
    grid[-1][0].set_xlabel("time [s]")
    grid[-1][1].set_xlabel("time since touch [s]")
    return figure


def _draw_touch(axes, trace: Trace, law: str) -> None:
    contact = trace.contact_1khz
    if not np.any(contact > CONTACT_N):
        note_empty(axes, "no touch")
        return
    touch = float(np.argmax(contact > CONTACT_N)) / PHYSICS_RATE_HZ
    clock = np.arange(len(contact)) / PHYSICS_RATE_HZ - touch
    near = (clock > -BEFORE_TOUCH_S) & (clock < AFTER_TOUCH_S)
    axes.plot(clock[near], contact[near], color=law_colour(law), linewidth=0.9)
    axes.plot(trace.t - trace.t[0] - touch, trace.push_reference, **REFERENCE)
    axes.set_xlim(-BEFORE_TOUCH_S, AFTER_TOUCH_S)
    text = f"peak {float(contact.max()):.1f} N"
    axes.text(0.97, 0.04, text, transform=axes.transAxes, ha="right", fontsize=8, color=law_colour(law))
