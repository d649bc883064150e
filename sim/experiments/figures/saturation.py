"""Saturation curves: what is delivered of what is asked, and what it costs in height and attitude."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import polars as pl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sim.experiments.figures.common import legend_below, plot_medians, select
from sim.experiments.figures.wrench_set import draw_wrench_set
from sim.figures.style import REFERENCE, law_name, new_figure

if TYPE_CHECKING:
    from sim.experiments.base import Results

#: Panels of a law: figure, axis label, factor, top of the axis; a crash ends far above it and is a cross at the top.
_PANELS = (
    ("push_mean_n", "delivered push [N]", 1.0, None),
    ("height_error_peak_m", "height error, peak [mm]", 1e3, 20.0),
    ("tilt_peak_deg", "tilt, peak [deg]", 1.0, 5.0),
)
_SLIDING = (
    ("push_mean_n", "delivered push [N]", 1.0, None),
    ("yaw_peak_deg", "yaw, peak [deg]", 1.0, None),
    ("speed_m_s", "speed [m/s]", 1.0, None),
)
#: Variant, friction, colour and words of the static presses.
_STATIC = (
    ("standard", 0.3, "#0b6f9e", "reach check, as shipped"),
    ("no-reach-check", 0.3, "#d55e1a", "no reach check"),
    ("no-reach-check", 0.05, "#9a4f8f", "no reach check, friction 0.05"),
    ("clipped", 0.3, "#2f8f5b", "clipped afterwards (QP only)"),
)
_FRICTIONS = (("standard", 0.3, "#0b6f9e", "friction 0.3"), ("standard", 0.8, "#d55e1a", "friction 0.8"))
#: Distance between the curves of one panel along x [N].
_APART = 0.28
_WRENCH_SETS = {
    "standard": "with the reach check",
    "no-reach-check": "without the reach check",
    "clipped": "thrusts clipped after a program without limits",
}


def draw_saturation(results: Results) -> dict[str, tuple[str, Figure]]:
    """Static presses, and sliding ones beside them if flown."""
    caption = "Asked against delivered push, height and tilt, standing still; one row per law"
    figures = {"saturation": (caption, _rows(select(results.table, kind="static"), _PANELS, _STATIC))}
    for variant, words in _WRENCH_SETS.items():
        rows = select(results.table, kind="static", variant=variant, friction=0.3)
        if rows.height:
            caption = (
                f"Attainable level forces without moment (shaded) and those flown while pressing, {words}; a dot "
                "outside has a moment, or less lift than the weight"
            )
            figures[f"wrench-set-{variant}"] = (caption, draw_wrench_set(results, rows))
    sliding = select(results.table, kind="sliding")
    if sliding.height and sliding["param.push_n"].n_unique() > 1:
        caption = "Sliding push up to the friction-aware limit; one row per law"
        figures["saturation-sliding"] = (caption, _rows(sliding, _SLIDING, _FRICTIONS))
    return figures


def _rows(table: pl.DataFrame, panels: tuple, lines: tuple) -> Figure:
    figure = new_figure(5.0)
    grid = figure.subplots(2, len(panels), sharex=True, sharey="col")
    for row, law in zip(grid, ("qp", "paper"), strict=True):
        for axes, (name, label, scale, top) in zip(row, panels, strict=True):
            for place, (variant, friction, colour, words) in enumerate(lines):
                flown = select(table, law=law, variant=variant, friction=friction)
                shift = _APART * (place - (len(lines) - 1) / 2)
                plot_medians(
                    axes, flown, "push_n", name, law, scale=scale, shift=shift, top=top, color=colour, label=words,
                    linewidth=1.0,
                )  # fmt: skip
            axes.set_ylabel(label if axes is not row[0] else f"{law_name(law)}\n{label}")
        _reaches(row[0], table, lines)
    for axes, (_, _, _, top) in zip(grid[0], panels, strict=True):
        axes.set_ylim(0.0, top)
    for axes in grid[-1]:
        axes.set_xlabel("asked push [N]")
    legend_below(figure, 3, fontsize=7.5)
    return figure


def _reaches(axes: Axes, table: pl.DataFrame, lines: tuple) -> None:
    asked = np.array([table["param.push_n"].min(), table["param.push_n"].max()], float)
    axes.plot(asked, asked, **REFERENCE)
    seen = set()
    for variant, friction, _, _ in lines:
        reach = select(table, variant=variant, friction=friction)["reach_n"].drop_nulls()
        if reach.len() and (value := round(float(reach[0]), 1)) not in seen:
            seen.add(value)
            axes.axhline(value, color="#888888", linewidth=0.8)
            axes.text(asked[0], value, f" reach {value:g} N", va="bottom", fontsize=7, color="#666666")
