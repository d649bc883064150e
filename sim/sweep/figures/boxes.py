"""Box plots: spread of a figure of merit at every level of every parameter, law beside law."""

from __future__ import annotations

import numpy as np
import polars as pl
from matplotlib.figure import Figure as Canvas

from sim.evaluate.figures import Figure
from sim.figures import style
from sim.figures.style import law_patches, new_figure
from sim.sweep.figures.levels import levels

#: Fraction of a level's width for its boxes together, and height of a panel [in].
_WIDTH, _PANEL_IN = 0.76, 1.9
#: A figure with a spread wider than this ratio has a logarithmic axis.
_LOG_SPREAD = 30.0
#: Letters of a row of tick labels that fit side by side.
_LETTERS = 90


def draw_boxes(table: pl.DataFrame, figure: Figure, columns: list[str]) -> Canvas:
    """One panel per parameter."""
    laws = [law for law in ("qp", "paper") if law in table["law"].unique()]
    canvas, values, width = new_figure(0.45 + _PANEL_IN * len(columns)), figure.values(table), _WIDTH / len(laws)
    finite, law_of = np.isfinite(values), table["law"].to_numpy()
    good = values[finite & (values > 0.0)]
    wide = len(good) > 1 and np.quantile(good, 0.98) > _LOG_SPREAD * np.quantile(good, 0.02)
    for axes, column in zip(canvas.subplots(len(columns), 1, squeeze=False)[:, 0], columns, strict=True):
        sorted_in = levels(table, column)
        count = len(sorted_in.names)
        for place, law in enumerate(laws):
            rows = finite & (law_of == law)
            by_level = [values[rows & (sorted_in.level == level)] for level in range(count)]
            style.draw_boxes(
                axes, by_level, np.arange(count) + (place - 0.5 * (len(laws) - 1)) * width, 0.9 * width, law
            )
        axes.set_xticks(range(count), sorted_in.names)
        axes.tick_params(axis="x", labelsize=8 if sum(map(len, sorted_in.names)) < _LETTERS else 6.5)
        axes.set_xlabel(sorted_in.label)
        axes.grid(visible=False, axis="x")
        if wide:
            axes.set_yscale("log")
        else:
            axes.set_ylim(bottom=0.0)
    canvas.supylabel(figure.label, fontsize=8.5)
    canvas.axes[0].legend(handles=law_patches(laws), loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=len(laws))
    return canvas
