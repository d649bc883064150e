"""Pictures of the camera at telling moments, figures of one flight, and its figures of merit."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sim.evaluate.metrics import compute_metrics
from sim.figures.style import new_figure
from sim.flight.trace import Trace
from sim.flight.video import unpack_picture

#: Moments shown of the camera: name of the phase, and where in it.
MOMENTS = (("approach", 0.5), ("press", 0.7), ("paint", 0.35), ("paint", 0.9))
#: Figures of merit by key: what they are, factor and unit.
MERIT = {
    "duration_s": ("flight", 1.0, "s"),
    "force_rms_straight_n": ("push minus commanded push, rms, straights", 1.0, "N"),
    "force_peak_n": ("greatest push", 1.0, "N"),
    "path_rms_straight_m": ("path error, rms, straights", 1e3, "mm"),
    "path_rms_corner_m": ("path error, rms, within 10 cm of a corner", 1e3, "mm"),
    "tilt_rms_deg": ("tilt, rms", 1.0, "°"),
    "tilt_peak_deg": ("tilt, greatest", 1.0, "°"),
    "coverage": ("intended band covered", 100.0, "%"),
    "propeller_clearance_min_m": ("least clearance of a propeller to the wall", 1e3, "mm"),
}


def draw_one(draw: Callable[[dict[str, Trace]], Figure], trace: Trace) -> Figure:
    """Any figure of a run's report, for one flight."""
    return draw({trace.law: trace})


def nearest_picture(trace: Trace, time_s: float) -> tuple[float, np.ndarray, str] | None:
    """Time, RGB picture and phase of the picture kept nearest to a time; None without pictures."""
    if not trace.pictures:
        return None
    when, packed, phase = min(trace.pictures, key=lambda entry: abs(entry[0] - time_s))
    return when, unpack_picture(packed), phase


def draw_camera_story(trace: Trace) -> Figure:
    """What the camera saw while approaching, pressing and painting, with the lines that were found."""
    figure = new_figure(5.9)
    for axes, (phase, share) in zip(figure.subplots(2, 2).ravel(), MOMENTS, strict=True):
        ticks = np.flatnonzero(trace.phase == trace.phases.index(phase))
        seen = nearest_picture(trace, float(trace.t[ticks[int(share * (len(ticks) - 1))]])) if len(ticks) else None
        show_picture(axes, seen, phase)
    return figure


def show_picture(axes: Axes, seen: tuple[float, np.ndarray, str] | None, phase: str) -> None:
    """A picture without axes, under its time and phase."""
    axes.set_axis_off()
    if seen is None:
        axes.set_title(f"{phase}: no picture")
        return
    axes.imshow(seen[1])
    axes.set_title(f"{seen[0]:.1f} s, {seen[2]}")


def merit_table(trace: Trace) -> str:
    """Figures of merit against the simulator's truth, as a markdown table."""
    metrics = compute_metrics(trace)
    lines = ["| | |", "|:--|--:|", f"| ended | {trace.reason} |"]
    for key, (name, factor, unit) in MERIT.items():
        value = factor * metrics[key]
        lines.append(f"| {name} | {'–' if math.isnan(value) else f'{value:.3g} {unit}'} |")
    return "\n".join(lines)
