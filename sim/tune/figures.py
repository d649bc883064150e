"""Figures of a search: the front of all trials, and shipped against tuned on unseen seeds."""

from __future__ import annotations

import itertools

import numpy as np
import polars as pl
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter, StrMethodFormatter

from sim.figures.style import FAINT, REFERENCE, law_colour, law_name, new_figure
from sim.sweep.parts import PARAM
from sim.tune.choice import front
from sim.tune.finalists import TUNED
from sim.tune.objectives import OBJECTIVES, Score
from sim.tune.verdict import paired

#: Upper end of the axes, as a multiple of the shipped preset.
_AXES_TO = 2.0
#: Logarithmic axes with a smaller ratio of their ends have linear ticks: no two of 1, 2, 5, 10 lie on them.
_NARROW = 3.0
_MARKERS = ("o", "s", "^", "D", "v", "P", "X", "<", "*")
_SHADES = ("#222222", "#8a8a8a", "#c0a000", "#7a5195", "#5a8f3c", "#2f8f8b", "#c06080", "#3d5a80")
#: Objectives that are drawn, with their places: those of painting that no flight has at 0.
DRAWN = {
    place: each
    for place, each in enumerate(OBJECTIVES)
    if each.name in ("force_rms_n", "path_rms_m", "tilt_peak_deg", "yaw_peak_deg", "jitter_n_s")
}


def draw_front(law: str, scores: dict[int, Score], shipped: Score, chosen: int | None) -> Figure:
    """Every pair of the drawn objectives: trials, Pareto front, the shipped and the chosen preset."""
    able = {number: each for number, each in scores.items() if not each.failed}
    best, drawn = front(scores), list(DRAWN)
    last = len(drawn) - 1
    figure = new_figure(7.0)
    grid = figure.subplots(last, last, sharex="col", sharey="row", squeeze=False)
    for i, j in itertools.product(range(last), range(1, last + 1)):
        axes = grid[j - 1, i]
        if i >= j:
            axes.remove()
            continue
        across, up = drawn[i], drawn[j]
        x, y = OBJECTIVES[across], OBJECTIVES[up]
        for numbers, colour, size, label in (
            ([number for number in able if number not in best], FAINT, 9, "trial"),
            (best, law_colour(law), 14, "on the front of all objectives"),
        ):
            points = np.array([able[number].values for number in numbers]).reshape(-1, len(OBJECTIVES))
            axes.scatter(
                x.scale * points[:, across], y.scale * points[:, up], s=size, color=colour, label=label, linewidth=0
            )
        start = shipped.values
        axes.scatter(x.scale * start[across], y.scale * start[up], s=60, marker="x", color="#222222", label="shipped")
        if chosen is not None:
            end = scores[chosen].values
            axes.scatter(x.scale * end[across], y.scale * end[up], s=70, marker="o", facecolor="none",
                         edgecolor="#222222", linewidth=1.3, label="chosen")  # fmt: skip
        for axis, objective, place in ((axes.set_xlim, x, across), (axes.set_ylim, y, up)):
            seen = [each.values[place] for each in [*able.values(), shipped]]
            axis(0.9 * objective.scale * min(seen), objective.scale * min(1.05 * max(seen), _AXES_TO * start[place]))
        if j == last:
            axes.set_xlabel(x.label)
        if i == 0:
            axes.set_ylabel(y.label)
    handles, labels = grid[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper right", ncols=4)
    figure.suptitle(f"{law_name(law)}, {len(scores)} trials", x=0.01, ha="left",
                    fontsize=9, fontweight="bold")  # fmt: skip
    return figure


def draw_unseen(law: str, table: pl.DataFrame) -> Figure:
    """Shipped against tuned, a mark per flight, logarithmic; below the diagonal the tuned preset is better."""
    both = paired(table)
    names = both[PARAM + "scene"].unique(maintain_order=True).to_list()
    assert len(names) <= len(_MARKERS)
    figure = new_figure(2.5)
    grid = figure.subplots(1, len(DRAWN))
    for axes, each in zip(grid, DRAWN.values(), strict=True):
        for scene, marker, shade in zip(names, _MARKERS, (law_colour(law), *_SHADES), strict=False):
            rows = both.filter(pl.col(PARAM + "scene") == scene)
            before, after = (
                each.scale * rows[name].cast(pl.Float64).to_numpy() for name in (each.name, f"{each.name}.{TUNED}")
            )
            axes.scatter(before, after, s=16, marker=marker, alpha=0.75, linewidth=0, label=scene,
                         color=shade)  # fmt: skip
        both_ways = each.scale * both.select(each.name, f"{each.name}.{TUNED}").cast(pl.Float64).to_numpy()
        reach = (0.85 * np.nanmin(both_ways), 1.15 * np.nanmax(both_ways))
        axes.plot(reach, reach, **REFERENCE)
        axes.set(xscale="log", yscale="log", xlim=reach, ylim=reach, aspect="equal")
        for axis in (axes.xaxis, axes.yaxis):
            narrow = reach[1] < _NARROW * reach[0]
            axis.set_major_locator(MaxNLocator(3) if narrow else LogLocator(subs=(1.0, 2.0, 5.0), numticks=6))
            axis.set_major_formatter(StrMethodFormatter("{x:g}"))
            axis.set_minor_formatter(NullFormatter())
        axes.set_title(each.label.replace(", ", ",\n"), fontsize=8)
        axes.set_xlabel("shipped")
    grid[0].set_ylabel("tuned")
    figure.legend(*grid[0].get_legend_handles_labels(), loc="outside lower center", ncols=len(names))
    figure.suptitle(f"{law_name(law)}, unseen seeds", x=0.01, ha="left", fontsize=9, fontweight="bold")
    return figure
