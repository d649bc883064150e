"""Box plots over flights: the spread over the seeds, and the cells of the noise sweep."""

from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from sim.experiments.figures.common import BOUND, Drawn, Results
from sim.experiments.spec import FigureSpec, Panel
from sim.figures.style import draw_boxes, law_patches, new_figure
from sim.sweep.parts import PARAM
from sim.sweep.statistics import select

#: Width of a box of the noise sweep and gap between both laws; cells are one apart.
_BOX, _GAP = 0.34, 0.04
#: Background of the combinations that the paper flies.
_DIAGONAL = "#f6f1e2"
#: Noise of a cell: sigma_vs, sigma_f [N].
_Cell = tuple[float, float]


def draw_spread(spec: FigureSpec, results: Results) -> Drawn:
    """One panel per metric, one box per law; left out for a single seed."""
    if results.table["seed"].n_unique() < 2:
        return {}
    flown = select(results.table, spec.where, variant="standard")
    figure = new_figure(2.5)
    for axes, panel in zip(figure.subplots(1, len(spec.panels)), spec.panels, strict=True):
        ticks = []
        for place, (law, words) in enumerate((("qp", "QP"), ("paper", "analytic"))):
            values = select(flown, law=law)[panel.metric].drop_nulls().to_numpy()
            draw_boxes(axes, [panel.scale * values], [place], 0.6, law)
            ticks.append(f"{words}\nn = {len(values)}")
        axes.set(title=panel.label, ylim=(0.0, None))
        axes.set_xticks([0, 1], ticks)
        axes.grid(visible=False, axis="x")
    return {spec.name: (spec.caption, figure)}


def noise_cells(results: Results) -> list[_Cell]:
    """Combinations of noise that were flown, in rising order."""
    pairs = results.table.select(PARAM + "sigma_vs", PARAM + "sigma_f_n").unique(maintain_order=True)
    return sorted((float(vs), float(force)) for vs, force in pairs.rows())


def draw_noise_boxes(spec: FigureSpec, results: Results) -> Drawn:
    """One row of boxes per metric: a pair of boxes per cell, with the bounds of the QP law."""
    cells = noise_cells(results)
    figure = new_figure(4.6)
    for axes, panel in zip(figure.subplots(2, 1, sharex=True), spec.panels, strict=True):
        for law, side in (("qp", -0.5), ("paper", 0.5)):
            for place, (vs, force) in enumerate(cells):
                rows = select(results.table, law=law, sigma_vs=vs, sigma_f_n=force)
                if panel.metric in rows.columns and rows[panel.metric].drop_nulls().len():
                    values = panel.scale * rows[panel.metric].drop_nulls().to_numpy()
                    draw_boxes(axes, [values], [place + side * (_BOX + _GAP)], _BOX, law)
        _bounds(axes, results, panel, cells)
        axes.set_ylabel(panel.label)
        axes.set_ylim(bottom=0.0)
        axes.grid(visible=False, axis="x")
    labels = [f"$\\sigma_{{vs}}$ {vs:g}\n$\\sigma_f$ {force:g} N" for vs, force in cells]
    figure.axes[1].set_xticks(range(len(cells)), labels)
    for place, cell in enumerate(cells):
        if cell in _diagonal(cells):
            for axes in figure.axes:
                axes.axvspan(place - 0.5, place + 0.5, color=_DIAGONAL, linewidth=0, zorder=0)
    flights = results.table.group_by("law", PARAM + "sigma_vs", PARAM + "sigma_f_n").len()["len"]
    count = f"{flights.min()}" if flights.min() == flights.max() else f"{flights.min()} to {flights.max()}"
    handles: list = law_patches()
    handles.append(Patch(facecolor=_DIAGONAL, label="the paper's diagonal"))
    handles.append(Line2D([], [], linewidth=0.8, label="bound", **BOUND))
    figure.axes[0].set_title(f"n = {count} per box")
    figure.axes[0].legend(handles=handles, loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=4)
    return {spec.name: (spec.caption, figure)}


def _diagonal(cells: list[_Cell]) -> list[_Cell]:
    """Combinations that the paper flies: least with least noise, and so on."""
    sigmas, forces = sorted({vs for vs, _ in cells}), sorted({force for _, force in cells})
    return list(zip(sigmas, forces, strict=False)) if len(sigmas) == len(forces) else []


def _bounds(axes: Axes, results: Results, panel: Panel, cells: list[_Cell]) -> None:
    for criterion in results.experiment.every_criterion():
        for place, (vs, force) in enumerate(cells):
            if (
                criterion.metric == panel.metric
                and criterion.where.items() <= {"sigma_vs": vs, "sigma_f_n": force}.items()
            ):
                ends = [place - 0.45, place + 0.45]
                axes.plot(ends, [panel.scale * criterion.bound] * 2, linewidth=0.8, **BOUND)
