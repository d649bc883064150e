"""Push force, image error, velocity, attitude, thrusts and active limits over time."""

from __future__ import annotations

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from allocation import TAROT_T960
from sim.evaluate.window import CONTACT_N, PHYSICS_RATE_HZ
from sim.figures.style import (
    FAINT,
    REFERENCE,
    ZERO,
    law_colour,
    law_panels,
    legend_above,
    new_figure,
    note_empty,
    runs,
    shade_phases,
    thin,
)
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


_GUIDES = (("horizontal guide", "#2f7d4f"), ("vertical guide", "#8a4fa3"))
#: The scale covers this percentile of all errors; a guide may first appear far from its reference.
SHOWN_PERCENTILE = 99.0
#: Smallest half height of the scale [px].
LEAST_SCALE_PX = 4.0


def draw_image_error(traces: dict[str, Trace]) -> Figure:
    """One panel per law: error of the horizontal and the vertical guide at the tip."""
    figure, panels = law_panels(traces, 0.3 + 1.75 * len(traces), sharex=True, sharey=True)
    errors = np.abs(np.concatenate([trace.line_error_px.ravel() for trace in traces.values()]))
    errors = errors[np.isfinite(errors)]
    scale = 1.15 * max(LEAST_SCALE_PX, float(np.percentile(errors, SHOWN_PERCENTILE)) if len(errors) else 0.0)
    for axes, _, trace in panels:
        shade_phases(axes, trace)
        t, error = thin(trace.t, trace.line_error_px)
        for column, (name, colour) in enumerate(_GUIDES):
            axes.plot(t, error[:, column], color=colour, label=name)
        axes.axhline(0.0, **ZERO)
        axes.set(ylabel="image error [px]", ylim=(-scale, scale))
    legend_above(panels[0][0])
    panels[-1][0].set_xlabel("time [s]")
    panels[-1][0].set_xlim(0.0, max(float(trace.t[-1]) for trace in traces.values()))
    return figure


#: An active stretch is drawn at least this long, so that a single tick is visible [s].
LEAST_WIDTH_S = 0.05


def draw_limits(traces: dict[str, Trace]) -> Figure:
    """One panel per law, one bar per limit where it was active; at the right its fraction of the flight."""
    counts = [max(1, len(trace.limits)) for trace in traces.values()]
    height = 0.8 + 0.55 * len(traces) + 0.2 * sum(counts)
    figure, panels = law_panels(traces, height, sharex=True, gridspec_kw={"height_ratios": counts})
    for (axes, law, trace), count in zip(panels, counts, strict=True):
        shade_phases(axes, trace, labels=False)
        axes.set(ylim=(count - 0.4, -0.6), yticks=[])
        axes.grid(visible=False)
        if not trace.limits or not trace.active.any():
            note_empty(axes, "no limit was active")
            continue
        order = np.argsort(-trace.active.mean(axis=0))
        axes.set_yticks(range(len(order)), [trace.limits[column].replace("_", " ") for column in order], fontsize=7)
        for place, column in enumerate(order):
            active = trace.active[:, column]
            bars = [
                (float(trace.t[first]), max(float(trace.t[last] - trace.t[first]), LEAST_WIDTH_S))
                for first, last in runs(active)
                if active[first]
            ]
            axes.broken_barh(bars, (place - 0.35, 0.7), color=law_colour(law), linewidth=0)
            text = f"{float(active.mean()):.2%}"
            axes.text(1.01, place, text, transform=axes.get_yaxis_transform(), va="center", fontsize=7)
    panels[-1][0].set_xlabel("time [s]")
    return figure


_VELOCITY = ("forward", "right", "down")
_ATTITUDE = ("roll", "pitch", "yaw")
#: Smallest half height of the attitude scale [deg].
LEAST_ATTITUDE_DEG = 0.5
_TRUE = {"color": "#333333", "linewidth": 0.9}


def draw_velocity(traces: dict[str, Trace]) -> Figure:
    """One column per law: true and estimated velocity in the body frame."""
    figure = new_figure(4.6)
    grid = figure.subplots(3, len(traces), squeeze=False, sharex="col", sharey="row")
    for column, (law, trace) in enumerate(traces.items()):
        t, true, estimate = thin(trace.t, trace.velocity, trace.velocity_estimate)
        for row, name in enumerate(_VELOCITY):
            axes = grid[row][column]
            shade_phases(axes, trace, labels=row == 0, columns=len(traces))
            axes.plot(t, estimate[:, row], color=law_colour(law), label="estimated")
            axes.plot(t, true[:, row], **_TRUE, label="true")
            if column == 0:
                axes.set_ylabel(f"{name} [m/s]")
        grid[0][column].set_title(law_name(law))
        grid[-1][column].set_xlabel("time [s]")
        legend_above(grid[0][column])
    for axes in grid[0]:
        low, high = axes.get_ylim()
        axes.set_ylim(low, high + 0.12 * (high - low))  # room for the labels of the phases
    return figure


def draw_attitude(traces: dict[str, Trace]) -> Figure:
    """True roll, pitch and yaw of all laws in common panels."""
    figure = new_figure(4.4)
    panels = figure.subplots(3, 1, sharex=True)
    longest = max(traces.values(), key=lambda trace: float(trace.t[-1]))
    for row, (axes, name) in enumerate(zip(panels, _ATTITUDE, strict=True)):
        axes.axhline(0.0, **ZERO)
        for law, trace in traces.items():
            t, euler = thin(trace.t, trace.euler)
            axes.plot(t, np.degrees(euler[:, row]), color=law_colour(law), label=law_name(law))
        shade_phases(axes, longest, labels=row == 0)
        axes.set_ylabel(f"{name} [deg]")
        low, high = axes.get_ylim()
        scale = 1.2 * max(abs(low), abs(high), LEAST_ATTITUDE_DEG)
        axes.set_ylim(-scale, scale)
    legend_above(panels[0])
    panels[-1].set_xlabel("time [s]")
    return figure


#: With a lower limit below this the scale is linear: a logarithmic one would show little but the limit [N].
LEAST_LOG_N = 0.1
#: Candidates for ticks of the logarithmic scale [N].
_LOG_TICKS_N = (0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200)
_LIMIT = {"color": "#b3261e", "linewidth": 0.9, "linestyle": (0, (5, 2))}


def draw_thrusts(traces: dict[str, Trace]) -> Figure:
    """One panel per law: commanded thrusts, limits, phases; names are those of the nominal vehicle if they fit."""
    figure, panels = law_panels(traces, 0.5 + 2.1 * len(traces), sharex=True, sharey=True)
    colours = matplotlib.colormaps["tab10"].colors  # type: ignore[attr-defined]
    for axes, _, trace in panels:
        shade_phases(axes, trace)
        t, thrusts = thin(trace.t, trace.thrusts)
        count = thrusts.shape[1]
        names = TAROT_T960.names
        names = names if len(names) == count else [f"rotor {number}" for number in range(1, count + 1)]
        for rotor, label in enumerate(names):
            line = {"color": colours[rotor % 10], "linewidth": 0.8, "label": label.replace("_", " ")}
            axes.plot(t, thrusts[:, rotor], **line)
        for limit in np.unique(np.concatenate((trace.thrust_min, trace.thrust_max))):
            axes.axhline(limit, **_LIMIT)
            place = {"xy": (1.0, limit), "xycoords": ("axes fraction", "data"), "textcoords": "offset points"}
            above = limit < trace.thrust_max.min()  # texts between the limits: above the panel stand the phases
            text = {"xytext": (-2, 2 if above else -2), "ha": "right", "va": "bottom" if above else "top"}
            axes.annotate(f"{limit:g} N", **place, **text, fontsize=7, color=_LIMIT["color"])
        axes.set_ylabel("thrust [N]")
        _scale(axes, float(np.min(trace.thrust_min)), float(np.max(trace.thrust_max)))
    figure.legend(*panels[0][0].get_legend_handles_labels(), loc="outside lower center", ncols=6)
    panels[-1][0].set_xlabel("time [s]")
    return figure


def _scale(axes: Axes, low: float, high: float) -> None:
    """Logarithmic, so that the lower limit, usually the first active one, stands apart from the thrusts above it."""
    if low < LEAST_LOG_N:
        axes.set_ylim(0.0, 1.15 * high)
        return
    axes.set_yscale("log")
    axes.set_ylim(low / 1.25, 1.6 * high)
    ticks = [tick for tick in _LOG_TICKS_N if low / 1.25 < tick < 1.6 * high]
    axes.set_yticks(ticks, [f"{tick:g}" for tick in ticks])
    axes.minorticks_off()
