"""Boxes, maps and pairs of a noise sweep, and one of its flights."""

from __future__ import annotations

import numpy as np
import polars as pl
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Drawing
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from sim.evaluate.path_error import path_error
from sim.figures.style import REFERENCE, law_colour, law_name, new_figure, shade_phases
from sim.flight.trace import Trace
from sim.notebook.noise.table import FIGURES, FORCE, VS, Figure, cell_values, grid_of, success

LAWS = ("qp", "paper")
#: Width of a box; a cell is one wide.
_BOX = 0.34
_MARKERS = ("o", "s", "^", "D", "v")


def draw_boxes(table: pl.DataFrame, figure: Figure) -> Drawing:
    """Boxes over the completed flights of every cell, both laws; dots are the flights."""
    sigmas, forces = grid_of(table)
    drawing = new_figure(3.2)
    axes = drawing.subplots()
    cells = [(vs, force) for vs in sigmas for force in forces]
    for place, (vs, force) in enumerate(cells):
        for law, side in zip(LAWS, (-0.5, 0.5), strict=True):
            _box(axes, cell_values(table, law, vs, force, figure), place + side * (_BOX + 0.04), law_colour(law))
    axes.set_xticks(range(len(cells)), [f"$\\sigma_{{vs}}$ {vs:g}\n$\\sigma_f$ {force:g} N" for vs, force in cells])
    axes.set(ylabel=figure.words)
    axes.set_ylim(bottom=0.0)
    axes.grid(visible=False, axis="x")
    handles = [Patch(facecolor=law_colour(law), alpha=0.5, label=law_name(law)) for law in LAWS]
    axes.legend(handles=handles, loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2)
    return drawing


def _box(axes: Axes, values: np.ndarray, place: float, colour: str) -> None:
    if not len(values):
        return
    boxes = axes.boxplot(
        [values],
        positions=[place],
        widths=_BOX,
        patch_artist=True,
        manage_ticks=False,
        showfliers=False,
        medianprops={"color": "#222222"},
    )
    boxes["boxes"][0].set(facecolor=colour, alpha=0.5, linewidth=0.6)
    axes.plot(np.full(len(values), place), values, ".", color=colour, markersize=3)


def draw_maps(table: pl.DataFrame, figure: Figure) -> Drawing:
    """Share completed, and the median of a figure, over both noises and per law."""
    sigmas, forces = grid_of(table)
    drawing = new_figure(3.9)
    grid = drawing.subplots(2, 2, sharex=True, sharey=True)
    shares = {(row["law"], row[VS], row[FORCE]): row["completed"] for row in success(table).to_dicts()}
    medians = {
        (law, vs, force): float(np.median(values)) if len(values) else np.nan
        for law in LAWS
        for vs in sigmas
        for force in forces
        for values in [cell_values(table, law, vs, force, figure)]
    }
    finite = [value for value in medians.values() if np.isfinite(value)]
    for column, law in enumerate(LAWS):
        for row, (values, limits, colours, form) in enumerate(
            (
                (shares, (0.0, 1.0), "RdYlGn", "{:.0%}"),
                (medians, (0.0, max(finite, default=1.0)), "Blues", "{:.3g}"),
            )
        ):
            matrix = np.array([[values.get((law, vs, force), np.nan) for force in forces] for vs in sigmas])
            _map(grid[row, column], matrix, limits, colours, form)
        grid[0, column].set_title(f"{law_name(law)}: flights completed")
        grid[1, column].set_title(f"{law_name(law)}: {figure.words}, median")
        grid[1, column].set_xticks(range(len(forces)), [f"{force:g}" for force in forces])
        grid[1, column].set_xlabel("force noise $\\sigma_f$ [N]")
    for axes in grid[:, 0]:
        axes.set_yticks(range(len(sigmas)), [f"{vs:g}" for vs in sigmas])
        axes.set_ylabel("line noise $\\sigma_{vs}$")
    return drawing


def _map(axes: Axes, matrix: np.ndarray, limits: tuple[float, float], colours: str, form: str) -> None:
    axes.imshow(matrix, vmin=limits[0], vmax=limits[1] or 1.0, cmap=colours, alpha=0.75, aspect="auto", origin="lower")
    for (row, column), value in np.ndenumerate(matrix):
        axes.text(column, row, form.format(value) if np.isfinite(value) else "–", ha="center", va="center", fontsize=8)
    axes.grid(visible=False)


def draw_path_and_push(table: pl.DataFrame) -> Drawing:
    """Path error against push error, one mark per completed flight: form by sigma_vs, size by sigma_f."""
    path, push = FIGURES[:2]
    sigmas, forces = grid_of(table)
    drawing = new_figure(3.2)
    axes = drawing.subplots()
    for law in LAWS:
        for vs, marker in zip(sigmas, _MARKERS, strict=False):
            for size, force in enumerate(forces):
                x, y = (cell_values(table, law, vs, force, figure) for figure in (push, path))
                axes.plot(
                    x, y, marker, color=law_colour(law), alpha=0.6, markersize=3.5 + 2.0 * size, markeredgewidth=0
                )
    axes.set(xlabel=push.words, ylabel=path.words, xlim=(0, None), ylim=(0, None))
    handles = [Line2D([], [], marker="o", linestyle="", color=law_colour(law), label=law_name(law)) for law in LAWS]
    handles += [
        Line2D([], [], marker=marker, linestyle="", color="#777777", label=f"$\\sigma_{{vs}}$ {vs:g}")
        for vs, marker in zip(sigmas, _MARKERS, strict=False)
    ]
    axes.set_title("Larger marks: more force noise")
    drawing.legend(handles=handles, loc="outside lower center", ncols=5)
    return drawing


def draw_flight(trace: Trace) -> Drawing:
    """Path error and push of one flight over time, with its phases."""
    drawing = new_figure(3.4)
    grid = drawing.subplots(2, 1, sharex=True)
    path, colour = path_error(trace), law_colour(trace.law)
    grid[0].plot(trace.t, np.where(path.painting, 1e3 * path.distance, np.nan), color=colour)
    grid[1].plot(trace.t, trace.push_measured, color="#999999", alpha=0.6, linewidth=0.6, label="felt, filtered")
    grid[1].plot(trace.t, trace.push_true, color=colour, label="true")
    grid[1].plot(trace.t, trace.push_reference, **REFERENCE, label="asked")
    grid[0].set(ylabel="path error [mm]", ylim=(0, None))
    grid[1].set(ylabel="push [N]", xlabel="time [s]")
    for index, axes in enumerate(grid):
        shade_phases(axes, trace, labels=index == 0)
    grid[1].legend(loc="upper left", ncols=3, fontsize=7)
    return drawing
