"""Figures of notebook 06: boxes, maps and pairs of a noise sweep."""

from __future__ import annotations

import numpy as np
import polars as pl
from matplotlib.figure import Figure as Drawing
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from sim.figures.style import law_colour, law_name, new_figure
from sim.notebook.noise import FIGURES, FORCE, LAWS, VS, Figure, cell_values, grid_of, success
from sim.notebook.plots import legend_below

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
        axes.boxplot(values, positions=places.tolist(), widths=_BOX, patch_artist=True, manage_ticks=False,
                     showfliers=False, medianprops={"color": "#222222"},
                     boxprops={"facecolor": colour, "alpha": 0.5, "linewidth": 0.6})  # fmt: skip
        dots = np.repeat(places, [len(each) for each in values])
        axes.plot(dots, np.concatenate(values), ".", color=colour, markersize=3)
    axes.set_xticks(range(len(cells)), [f"$\\sigma_{{vs}}$ {vs:g}\n$\\sigma_f$ {force:g} N" for vs, force in cells])
    axes.set(ylabel=figure.label, ylim=(0.0, None))
    axes.grid(visible=False, axis="x")
    handles = [Patch(facecolor=law_colour(law), alpha=0.5, label=law_name(law)) for law in LAWS]
    axes.legend(handles=handles, loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2)
    return drawing


def draw_maps(sweep: pl.DataFrame, figure: Figure) -> Drawing:
    """Fraction completed, and the median of a figure, over both noises per law."""
    sigmas, forces = grid_of(sweep)
    completed = {(row["law"], row[VS], row[FORCE]): row["completed"] for row in success(sweep).to_dicts()}
    fractions = np.array([[[completed.get((law, v, f), np.nan) for f in forces] for v in sigmas] for law in LAWS])
    values = [[[cell_values(sweep, law, v, f, figure) for f in forces] for v in sigmas] for law in LAWS]
    medians = np.array([[[np.median(c) if len(c) else np.nan for c in row] for row in rows] for rows in values])
    top = float(np.nanmax(medians)) if np.isfinite(medians).any() else 1.0
    drawing = new_figure(3.9)
    grid = drawing.subplots(2, 2, sharex=True, sharey=True)
    for row, (maps, highest, colours, form, title) in enumerate(
        (
            (fractions, 1.0, "RdYlGn", "{:.0%}", "flights completed"),
            (medians, top or 1.0, "Blues", "{:.3g}", f"{figure.label}, median"),
        )
    ):
        for axes, law, values in zip(grid[row], LAWS, maps, strict=True):
            axes.imshow(values, vmin=0.0, vmax=highest, cmap=colours, alpha=0.75, aspect="auto", origin="lower")
            for (y, x), value in np.ndenumerate(values):
                text = form.format(value) if np.isfinite(value) else "–"
                axes.text(x, y, text, ha="center", va="center", fontsize=8)
            axes.set_title(f"{law_name(law)}: {title}")
            axes.grid(visible=False)
    for axes in grid[1]:
        axes.set_xticks(range(len(forces)), [f"{force:g}" for force in forces])
        axes.set_xlabel("force noise $\\sigma_f$ [N]")
    for axes in grid[:, 0]:
        axes.set_yticks(range(len(sigmas)), [f"{vs:g}" for vs in sigmas])
        axes.set_ylabel("line noise $\\sigma_{vs}$")
    return drawing


def draw_path_and_push(sweep: pl.DataFrame) -> Drawing:
    """Path error against push error, one mark per completed flight: form by sigma_vs, size by sigma_f."""
    (path, push), (sigmas, forces) = FIGURES[:2], grid_of(sweep)
    drawing = new_figure(3.2)
    axes = drawing.subplots()
    for law in LAWS:
        for vs, marker in zip(sigmas, _MARKERS, strict=False):
            for size, force in enumerate(forces):
                x, y = (cell_values(sweep, law, vs, force, figure) for figure in (push, path))
                style = {"alpha": 0.6, "markersize": 3.5 + 2.0 * size, "markeredgewidth": 0}
                axes.plot(x, y, marker, color=law_colour(law), **style)
    axes.set(
        xlabel=push.label, ylabel=path.label, xlim=(0, None), ylim=(0, None), title="Larger marks: more force noise"
    )
    entries = [("o", law_colour(law), law_name(law)) for law in LAWS]
    entries += [(m, "#777777", f"$\\sigma_{{vs}}$ {vs:g}") for vs, m in zip(sigmas, _MARKERS, strict=False)]
    handles = [Line2D([], [], marker=m, linestyle="", color=colour, label=label) for m, colour, label in entries]
    legend_below(drawing, handles, ncols=5)
    return drawing
