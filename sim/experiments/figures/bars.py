"""Horizontal bars of a few metrics per value of a parameter, both laws."""

from __future__ import annotations

import numpy as np

from sim.experiments.figures.common import Drawn, Results
from sim.experiments.spec import FigureSpec
from sim.figures.style import law_colour, law_name, new_figure
from sim.sweep.parts import PARAM
from sim.sweep.spec import LAWS
from sim.sweep.statistics import completed, median_interval, select

#: Width of the bars of a value together; values of the parameter are one apart.
_WIDTH = 0.76
#: Opacity of the bars of each variant as a ratio of that of the one before; the first is opaque.
_PALER = 0.6


def draw_bars(spec: FigureSpec, results: Results) -> Drawn:
    """Bars per value of the parameter: one per law, and per variant of the figure with flights of the law."""
    table = select(results.table, spec.where)
    if not table.height:
        return {}
    series = [
        (law, variant) for law in LAWS for variant in spec.variants if select(table, law=law, variant=variant).height
    ]
    bar = _WIDTH / max(len(series), 1)
    values = list(table[PARAM + spec.x].unique(maintain_order=True))
    figure = new_figure(0.9 + 0.3 * len(values))
    grid = figure.subplots(1, len(spec.panels), sharey=True)
    crashed = False
    for axes, panel in zip(grid, spec.panels, strict=True):
        for index, (law, variant) in enumerate(series):
            rows = [select(table, {spec.x: value}, law=law, variant=variant) for value in values]
            found = [median_interval(completed(row, panel.metric)) for row in rows]
            middle, low, high = (
                panel.scale * np.array([entry[part] for entry in found]) for part in ("median", "low", "high")
            )
            places = np.arange(len(values)) + (index - 0.5 * (len(series) - 1)) * bar
            order = spec.variants.index(variant)
            label = law_name(law) + (f", {variant}" if order else "")
            axes.barh(places, middle, height=bar, color=law_colour(law), alpha=_PALER**order, label=label)
            ends = np.vstack((middle - low, high - middle))
            axes.errorbar(middle, places, xerr=ends, fmt="none", ecolor="#333333", capsize=1.5, linewidth=0.8)
            for place, row in zip(places, rows, strict=True):
                failed = int((~row["completed"]).sum())
                if failed:
                    axes.text(0.02, place, f"x {failed}", transform=axes.get_yaxis_transform(), va="center",
                              fontsize=7, color="#222222")  # fmt: skip
                    crashed = True
        axes.set_xlabel(panel.label)
        axes.grid(visible=False, axis="y")
    grid[0].set_yticks(range(len(values)), ["no error" if value == "nothing" else value for value in values])
    grid[0].set_ylim(len(values) - 0.4, -0.6)
    handles, labels = grid[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4)
    note = "; x: flights that did not end as planned, left out" if crashed else ""
    return {spec.name: (spec.caption + note, figure)}
