"""Box plots: how a figure of merit is spread at every level of every parameter, law beside law."""

from __future__ import annotations

import numpy as np
import polars as pl
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas
from matplotlib.patches import Patch

from sim.figures.style import law_colour, law_name, new_figure
from sim.sweep.figures.shown import Figure, Levels, levels

#: Share of a level's width that its boxes take together, and height of a panel [in].
_WIDTH, _PANEL_IN = 0.76, 1.9
#: A figure whose spread is wider than this ratio is drawn on a logarithmic axis.
_LOG_SPREAD = 30.0
#: Letters of a row of tick labels that fit without touching.
_LETTERS = 90


def draw_boxes(table: pl.DataFrame, figure: Figure, columns: list[str]) -> Canvas:
    """One panel per parameter."""
    laws = [law for law in ("qp", "paper") if law in table["law"].unique()]
    canvas = new_figure(0.45 + _PANEL_IN * len(columns))
    values = figure.scale * table[figure.column].cast(pl.Float64).fill_null(float("nan")).to_numpy()
    law_of = table["law"].to_numpy()
    good = values[np.isfinite(values) & (values > 0.0)]
    wide = len(good) > 1 and np.quantile(good, 0.98) > _LOG_SPREAD * np.quantile(good, 0.02)
    for axes, column in zip(canvas.subplots(len(columns), 1, squeeze=False)[:, 0], columns, strict=True):
        sorted_in = levels(table, column)
        for place, law in enumerate(laws):
            _law_boxes(axes, np.where(law_of == law, values, np.nan), sorted_in, law, place, len(laws))
        axes.set_xticks(range(len(sorted_in.names)), sorted_in.names)
        axes.tick_params(axis="x", labelsize=8 if sum(map(len, sorted_in.names)) < _LETTERS else 6.5)
        axes.set_xlabel(sorted_in.label)
        axes.grid(visible=False, axis="x")
        if wide:
            axes.set_yscale("log")
        else:
            axes.set_ylim(bottom=0.0)
    canvas.supylabel(figure.label, fontsize=8.5)
    handles = [Patch(facecolor=law_colour(law), alpha=0.5, label=law_name(law)) for law in laws]
    canvas.axes[0].legend(handles=handles, loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=len(laws))
    return canvas


def _law_boxes(axes: Axes, values: np.ndarray, sorted_in: Levels, law: str, place: int, count: int) -> None:
    width = _WIDTH / count
    for level in range(len(sorted_in.names)):
        here = values[(sorted_in.level == level) & np.isfinite(values)]
        if not len(here):
            continue
        boxes = axes.boxplot(
            [here],
            positions=[level + (place - 0.5 * (count - 1)) * width],
            widths=0.9 * width,
            patch_artist=True,
            manage_ticks=False,
            medianprops={"color": "#222222"},
            flierprops={"markersize": 3, "marker": "."},
        )
        boxes["boxes"][0].set(facecolor=law_colour(law), alpha=0.5, linewidth=0.6)
