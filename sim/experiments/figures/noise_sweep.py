"""Box plots of the noise sweep, and the visual error along the path."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from sim.evaluate.path_error import path_error
from sim.experiments.figures.common import kept_trace, legend_below, select
from sim.figures.style import FAINT, law_colour, law_name, new_figure
from sim.sweep.parts import PARAM

if TYPE_CHECKING:
    from sim.experiments.base import Results

_BOX = 0.34  # width of a box; a cell is one wide
_BOUND = {"color": "#555555", "linewidth": 0.8, "linestyle": (0, (6, 3))}
_PANELS = (("path_rms_m", "path error, rms [mm]", 1e3), ("force_rms_n", "push error, rms [N]", 1.0))


def draw_noise_sweep(results: Results) -> dict[str, tuple[str, Figure]]:
    """Boxes of path and push per cell and law; error along the path per sigma_vs."""
    return {
        "noise-sweep": ("Path and push under feature and force noise, box plots over flights", _boxes(results)),
        "noise-sweep-path": ("Path error along the painted C, one flight per noise and law", _along(results)),
    }


def _cells(results: Results) -> list[tuple[float, float]]:
    table = results.table
    pairs = table.select(PARAM + "sigma_vs", PARAM + "sigma_f_n").unique(maintain_order=True)
    return sorted((float(vs), float(force)) for vs, force in pairs.rows())


def _boxes(results: Results) -> Figure:
    cells = _cells(results)
    figure = new_figure(4.6)
    for axes, (name, label, scale) in zip(figure.subplots(2, 1, sharex=True), _PANELS, strict=True):
        for law, side in (("qp", -0.5), ("paper", 0.5)):
            _law_boxes(axes, results, cells, law, name, scale, side)
        _bounds(axes, results, cells, name, scale)
        axes.set_ylabel(label)
        axes.set_ylim(bottom=0.0)
        axes.grid(visible=False, axis="x")
    labels = [f"$\\sigma_{{vs}}$ {vs:g}\n$\\sigma_f$ {force:g} N" for vs, force in cells]
    figure.axes[1].set_xticks(range(len(cells)), labels)
    for place, cell in enumerate(cells):
        if cell in _diagonal(cells):
            for axes in figure.axes:
                axes.axvspan(place - 0.5, place + 0.5, color="#f6f1e2", linewidth=0, zorder=0)
    flights = results.table.group_by("law", PARAM + "sigma_vs", PARAM + "sigma_f_n").len()["len"]
    count = f"{flights.min()}" if flights.min() == flights.max() else f"{flights.min()} to {flights.max()}"
    handles: list = [Patch(facecolor=law_colour(law), alpha=0.5, label=law_name(law)) for law in ("qp", "paper")]
    handles.append(Patch(facecolor="#f6f1e2", label="the paper's diagonal"))
    handles.append(Line2D([], [], **_BOUND, label="bound"))
    figure.axes[0].set_title(f"n = {count} per box")
    figure.axes[0].legend(handles=handles, loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=4)
    return figure


def _diagonal(cells: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """The combinations that the paper flies: least with least noise, and so on."""
    sigmas, forces = sorted({vs for vs, _ in cells}), sorted({force for _, force in cells})
    return list(zip(sigmas, forces, strict=False)) if len(sigmas) == len(forces) else []


def _bounds(axes: Axes, results: Results, cells: list[tuple[float, float]], name: str, scale: float) -> None:
    from sim.experiments import experiment  # experiments are defined with their figures: not at import time

    for criterion in experiment(results.table["experiment"][0]).criteria:
        for place, (vs, force) in enumerate(cells):
            own = {"sigma_vs": vs, "sigma_f_n": force}
            if criterion.metric == name and all(own.get(key) == value for key, value in criterion.params.items()):
                axes.plot([place - 0.45, place + 0.45], [scale * criterion.bound] * 2, **_BOUND)


def _law_boxes(
    axes: Axes, results: Results, cells: list[tuple[float, float]], law: str, name: str, scale: float, side: float
) -> None:
    for place, (vs, force) in enumerate(cells):
        rows = select(results.table, law=law, sigma_vs=vs, sigma_f_n=force)
        values = scale * rows[name].drop_nulls().to_numpy() if name in rows.columns else np.array([])
        if not len(values):
            continue
        boxes = axes.boxplot(
            [values],
            positions=[place + side * (_BOX + 0.04)],
            widths=_BOX,
            patch_artist=True,
            manage_ticks=False,
            medianprops={"color": "#222222"},
            flierprops={"markersize": 3, "marker": "."},
        )
        boxes["boxes"][0].set(facecolor=law_colour(law), alpha=0.5, linewidth=0.6)


def _along(results: Results) -> Figure:
    cells = _cells(results)
    sigmas = sorted({vs for vs, _ in cells})
    figure = new_figure(0.7 + 1.4 * len(sigmas))
    grid = figure.subplots(len(sigmas), 1, sharex=True, sharey=True, squeeze=False)[:, 0]
    for axes, sigma in zip(grid, sigmas, strict=True):
        forces = [force for vs, force in cells if vs == sigma]
        for law in ("paper", "qp"):
            for force, dash in zip(forces, ("-", "--", ":"), strict=False):
                trace = kept_trace(results, select(results.table, law=law, sigma_vs=sigma, sigma_f_n=force))
                path = path_error(trace) if trace is not None else None
                if path is None or not path.painting.any():
                    continue
                step = np.linalg.norm(np.diff(path.tip[path.painting], axis=0), axis=1)
                way = np.concatenate(([0.0], np.cumsum(step)))
                label = f"{law_name(law)}, $\\sigma_f$ {force:g} N"
                error = 1e3 * path.distance[path.painting]
                axes.plot(way, error, dash, color=law_colour(law), linewidth=0.8, label=label)
        drawn = bool(axes.lines)
        _corners(axes, results, sigma, drawn)
        axes.set_ylabel("path error [mm]")
        axes.set_title(f"$\\sigma_{{vs}}$ = {sigma:g}")
        if not drawn:
            axes.text(0.5, 0.5, "nothing was painted", transform=axes.transAxes, ha="center", color="#777777")
    grid[0].set_ylim(bottom=0.0)
    grid[-1].set_xlabel("distance along the path [m]")
    legend_below(figure, 3)
    return figure


def _corners(axes: Axes, results: Results, sigma: float, drawn: bool) -> None:
    """Corners of the nominal C, and the band from the least to the greatest rms error of the QP law's flights."""
    rows = select(results.table, law="qp", sigma_vs=sigma)
    trace = kept_trace(results, rows)
    if trace is not None:
        paint = trace.scene.paint
        corners = np.cumsum([leg for row in range(1, paint.rows) for leg in (paint.stroke_m, paint.pitch_m)])
        for corner in corners:
            axes.axvline(corner, color="#888888", linewidth=0.7, linestyle=":", label="corners")
    values = 1e3 * rows.filter(rows["completed"])["path_rms_m"].drop_nulls().to_numpy()
    if len(values) > 1 and drawn:
        words = "rms error of every flight, QP law"
        axes.axhspan(
            float(values.min()), float(values.max()), color=FAINT, alpha=0.5, linewidth=0, zorder=0, label=words
        )
