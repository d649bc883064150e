"""Figures of notebook 06: boxes, maps and pairs of a noise sweep."""

from __future__ import annotations

import numpy as np
import polars as pl
from matplotlib.figure import Figure as Drawing
from matplotlib.lines import Line2D

from sim.evaluate.figures import Figure
from sim.figures import style
from sim.figures.style import law_colour, law_name, law_patches, legend_below, new_figure
from sim.notebook.noise import FIGURES, FORCE, LAWS, VS, cell_values, grid_of
from sim.sweep.figures.maps import draw_figure_maps, draw_success_maps

#: Width of a box; a cell has width one.
_BOX = 0.34
_MARKERS = ("o", "s", "^", "D", "v")


def draw_boxes(sweep: pl.DataFrame, figure: Figure) -> Drawing:
    """Boxes over the completed flights of every cell under both laws; dots are flights."""
    sigmas, forces = grid_of(sweep)
    cells = [(vs, force) for vs in sigmas for force in forces]
    drawing = new_figure(3.2)
    axes = drawing.subplots()
    for law, side in zip(LAWS, (-0.5, 0.5), strict=True):
        values = [cell_values(sweep, law, vs, force, figure) for vs, force in cells]
        places, colour = np.arange(len(cells)) + side * (_BOX + 0.04), law_colour(law)
        style.draw_boxes(axes, values, places, _BOX, law)
        dots = np.repeat(places, [len(each) for each in values])
        axes.plot(dots, np.concatenate(values), ".", color=colour, markersize=3)
    axes.set_xticks(range(len(cells)), [f"$\\sigma_{{vs}}$ {vs:g}\n$\\sigma_f$ {force:g} N" for vs, force in cells])
    axes.set(ylabel=figure.label, ylim=(0.0, None))
    axes.grid(visible=False, axis="x")
    axes.legend(handles=law_patches(), loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2)
    return drawing


def draw_completed(sweep: pl.DataFrame) -> Drawing:
    """Percentage of completed flights over both noises per law, and the difference of the laws."""
    return draw_success_maps(sweep, [FORCE, VS])


def draw_medians(sweep: pl.DataFrame, figure: Figure) -> Drawing:
    """Median of a figure over the completed flights per law and both noises, and the difference of the laws."""
    return draw_figure_maps(sweep.filter(pl.col("completed")), figure, [FORCE, VS])


def draw_path_and_push(sweep: pl.DataFrame) -> Drawing:
    """Path error against push error, one mark per completed flight: form by sigma_vs, size by sigma_f."""
    (path, push), (sigmas, forces) = FIGURES[:2], grid_of(sweep)
    drawing = new_figure(3.2)
    axes = drawing.subplots()
    for law in LAWS:
        for vs, marker in zip(sigmas, _MARKERS, strict=False):
            for size, force in enumerate(forces):
                x, y = (cell_values(sweep, law, vs, force, figure) for figure in (push, path))
                marks = {"alpha": 0.6, "markersize": 3.5 + 2.0 * size, "markeredgewidth": 0}
                axes.plot(x, y, marker, color=law_colour(law), **marks)
    axes.set(
        xlabel=push.label, ylabel=path.label, xlim=(0, None), ylim=(0, None), title="Larger marks: more force noise"
    )
    entries = [("o", law_colour(law), law_name(law)) for law in LAWS]
    entries += [(m, "#777777", f"$\\sigma_{{vs}}$ {vs:g}") for vs, m in zip(sigmas, _MARKERS, strict=False)]
    handles = [Line2D([], [], marker=m, linestyle="", color=colour, label=label) for m, colour, label in entries]
    legend_below(drawing, handles, columns=5)
    return drawing
