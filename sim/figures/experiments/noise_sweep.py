"""Box plots of the noise sweep, and the visual error along the path."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from sim.figures.experiments.common import kept_trace, select
from sim.figures.style import FAINT, law_colour, law_name, new_figure
from sim.path_error import path_error
from sim.sweep.parts import PARAM

if TYPE_CHECKING:
    from sim.experiments.base import Results

_BOX = 0.34  # width of a box; a cell is one wide
_PANELS = (("path_rms_m", "path error, rms [mm]", 1e3), ("force_rms_n", "push error, rms [N]", 1.0))


def draw_noise_sweep(results: Results) -> dict[str, tuple[str, Figure]]:
    """Boxes of path and push per cell and law; error along the path per sigma_vs."""
    return {
        "noise-sweep": ("Path and push under feature and force noise, box plots over flights", _boxes(results)),
        "noise-sweep-path": ("Path error along the painted C, one flight per noise, QP law", _along(results)),
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
        axes.set_ylabel(label)
        axes.set_ylim(bottom=0.0)
        axes.grid(visible=False, axis="x")
    labels = [f"$\\sigma_{{vs}}$ {vs:g}\n$\\sigma_f$ {force:g} N" for vs, force in cells]
    figure.axes[1].set_xticks(range(len(cells)), labels)
    handles = [Patch(facecolor=law_colour(law), alpha=0.5, label=law_name(law)) for law in ("qp", "paper")]
    figure.axes[0].legend(handles=handles, loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2)
    return figure


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
    figure = new_figure(0.5 + 1.35 * len(sigmas))
    grid = figure.subplots(len(sigmas), 1, sharex=True, sharey=True, squeeze=False)[:, 0]
    for axes, sigma in zip(grid, sigmas, strict=True):
        forces = [force for vs, force in cells if vs == sigma]
        for force, shade in zip(forces, np.linspace(1.0, 0.35, len(forces)), strict=True):
            trace = kept_trace(results, select(results.table, law="qp", sigma_vs=sigma, sigma_f_n=force))
            path = path_error(trace) if trace is not None else None
            if path is None or not path.painting.any():
                continue
            step = np.linalg.norm(np.diff(path.tip[path.painting], axis=0), axis=1)
            way = np.concatenate(([0.0], np.cumsum(step)))
            axes.plot(
                way,
                1e3 * path.distance[path.painting],
                color=law_colour("qp"),
                alpha=float(shade),
                linewidth=0.8,
                label=f"$\\sigma_f$ {force:g} N",
            )
        axes.axhline(0.0, color=FAINT, linewidth=0.8)
        axes.set_ylabel("path error [mm]")
        axes.set_title(f"$\\sigma_{{vs}}$ = {sigma:g}")
        if axes.lines[:-1]:
            axes.legend(loc="upper right", ncols=3)
        else:
            axes.text(0.5, 0.5, "nothing was painted", transform=axes.transAxes, ha="center", color="#777777")
    grid[-1].set_xlabel("way of the tip [m]")
    return figure
