"""Saturation curves: what is delivered of what is asked, and what it costs in height and attitude."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from sim.figures.experiments.common import plot_medians, select
from sim.figures.experiments.wrench_set import draw_wrench_set
from sim.figures.style import REFERENCE, law_name, new_figure

if TYPE_CHECKING:
    from sim.experiments.base import Results

#: Panels below the delivered push: figure, axis label, factor.
_PANELS = (
    ("push_mean_n", "delivered push [N]", 1.0),
    ("height_error_peak_m", "height error, peak [mm]", 1e3),
    ("tilt_peak_deg", "tilt, peak [deg]", 1.0),
)
#: Line style of a variant and friction of the static presses.
_STYLES = (
    ("standard", 0.3, "-", "reach check"),
    ("no-reach-check", 0.3, "--", "no reach check"),
    ("no-reach-check", 0.05, ":", "no check, friction 0.05"),
    ("clipped", 0.3, "-.", "clipped afterwards"),
)
#: Offset of the laws along x [N].
_SHIFT = {"qp": -0.12, "paper": 0.12}


def draw_saturation(results: Results) -> dict[str, tuple[str, Figure]]:
    """Static presses, and sliding ones beside them if flown."""
    figures = {"saturation": ("Asked against delivered push, height and tilt, standing still", _static(results))}
    for variant, words in (("standard", "with the reach check"), ("no-reach-check", "without the reach check")):
        rows = select(results.table, kind="static", variant=variant, friction=0.3)
        if rows.height:
            caption = f"Attainable level forces and those flown while pressing, {words}"
            figures[f"wrench-set-{variant}"] = (caption, draw_wrench_set(results, rows))
    sliding = select(results.table, kind="sliding")
    if sliding.height and sliding["param.push_n"].n_unique() > 1:
        caption = "Sliding push up to the friction-aware limit"
        figures["saturation-sliding"] = (caption, _sliding(results))
    return figures


def _static(results: Results) -> Figure:
    table = select(results.table, kind="static")
    figure = new_figure(3.0)
    axes = figure.subplots(1, 3)
    for panel, (name, label, scale) in zip(axes, _PANELS, strict=True):
        for law in ("qp", "paper"):
            for variant, friction, dash, words in _STYLES:
                rows = select(table, law=law, variant=variant, friction=friction)
                plot_medians(
                    panel,
                    rows,
                    "push_n",
                    name,
                    law,
                    scale=scale,
                    shift=_SHIFT[law],
                    linestyle=dash,
                    label=f"{law_name(law)}, {words}",
                    linewidth=1.0,
                )
        panel.set(xlabel="asked push [N]", ylabel=label)
    asked = np.array([table["param.push_n"].min(), table["param.push_n"].max()], float)
    axes[0].plot(asked, asked, **REFERENCE)
    reach = table["reach_n"].drop_nulls()
    if reach.len():
        axes[0].axhline(float(reach[0]), color="#888888", linewidth=0.8)
        axes[0].text(asked[0], float(reach[0]), f" reach {reach[0]:.1f} N", va="bottom", fontsize=7, color="#666666")
    axes[1].set_ylim(bottom=0.0)
    axes[2].set_ylim(bottom=0.0)
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3, fontsize=7)
    return figure


def _sliding(results: Results) -> Figure:
    table = select(results.table, kind="sliding")
    figure = new_figure(2.9)
    axes = figure.subplots(1, 3)
    panels = (("push_mean_n", "delivered push [N]"), ("yaw_peak_deg", "yaw, peak [deg]"), ("speed_m_s", "speed [m/s]"))
    for panel, (name, label) in zip(axes, panels, strict=True):
        for law in ("qp", "paper"):
            for friction, dash in ((0.3, "-"), (0.8, "--")):
                rows = select(table, law=law, friction=friction)
                plot_medians(
                    panel,
                    rows,
                    "push_n",
                    name,
                    law,
                    shift=_SHIFT[law],
                    linestyle=dash,
                    label=f"{law_name(law)}, friction {friction:g}",
                    linewidth=1.0,
                )
        panel.set(xlabel="asked push [N]", ylabel=label)
    asked = np.array([table["param.push_n"].min(), table["param.push_n"].max()], float)
    axes[0].plot(asked, asked, **REFERENCE)
    for friction, dash in ((0.3, "-"), (0.8, "--")):
        reach = select(table, friction=friction)["reach_n"].drop_nulls()
        if reach.len():
            axes[0].axhline(float(reach[0]), color="#888888", linewidth=0.8, linestyle=dash)
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4, fontsize=7)
    return figure
