"""Path error along the painted C, one flight per noise and law."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from sim.evaluate.path_error import path_error
from sim.experiments.figures.boxes import noise_cells
from sim.experiments.figures.common import Drawn, Results, stored_trace
from sim.experiments.spec import FigureSpec
from sim.figures.style import FAINT, law_colour, law_name, legend_below, new_figure, note_empty
from sim.sweep.statistics import completed, select
from sim.world.board import BoardGeometry


def draw_path_error(spec: FigureSpec, results: Results) -> Drawn:
    """One panel per sigma_vs: error over the distance painted."""
    cells = noise_cells(results)
    sigmas = sorted({vs for vs, _ in cells})
    figure = new_figure(0.7 + 1.4 * len(sigmas))
    grid = figure.subplots(len(sigmas), 1, sharex=True, sharey=True, squeeze=False)[:, 0]
    for axes, sigma in zip(grid, sigmas, strict=True):
        forces = [force for vs, force in cells if vs == sigma]
        for law in ("paper", "qp"):
            for force, dash in zip(forces, ("-", "--", ":"), strict=False):
                trace = stored_trace(results, select(results.table, law=law, sigma_vs=sigma, sigma_f_n=force))
                path = path_error(trace) if trace is not None else None
                if path is None or not path.painting.any():
                    continue
                label = f"{law_name(law)}, $\\sigma_f$ {force:g} N"
                error = 1e3 * path.distance[path.painting]
                axes.plot(path.travelled, error, dash, color=law_colour(law), linewidth=0.8, label=label)
        drawn = bool(axes.lines)
        _corners(axes, results, sigma, drawn)
        axes.set_ylabel("path error [mm]")
        axes.set_title(f"$\\sigma_{{vs}}$ = {sigma:g}")
        if not drawn:
            note_empty(axes, "nothing was painted")
    grid[0].set_ylim(bottom=0.0)
    grid[-1].set_xlabel("distance along the path [m]")
    legend_below(figure, columns=3)
    return {spec.name: (spec.caption, figure)}


def _corners(axes: Axes, results: Results, sigma: float, drawn: bool) -> None:
    """Corners of the nominal C, and the band from the least to the greatest rms error of the QP law's flights."""
    rows = select(results.table, law="qp", sigma_vs=sigma)
    trace = stored_trace(results, rows)
    if trace is not None:
        paint = trace.scene.paint
        corners = np.cumsum([paint.stroke_m, paint.pitch_m] * (BoardGeometry(trace.scene).strokes - 1))
        for corner in corners:
            axes.axvline(corner, color="#888888", linewidth=0.7, linestyle=":", label="corners")
    values = 1e3 * completed(rows, "path_rms_m")
    if len(values) > 1 and drawn:
        label = "rms error of every flight, QP law"
        axes.axhspan(values.min(), values.max(), color=FAINT, alpha=0.5, linewidth=0, zorder=0, label=label)
