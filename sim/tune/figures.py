"""Figures of a search: all trials by their objectives, and tuned over shipped on unseen seeds."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import polars as pl
from matplotlib.figure import Figure

from sim.figures.style import FAINT, REFERENCE, draw_boxes, law_colour, law_name, new_figure
from sim.tune.choice import front
from sim.tune.finalists import TUNED
from sim.tune.objectives import OBJECTIVES, Score
from sim.tune.verdict import paired

#: Upper end of the axes, as a multiple of the shipped preset.
_AXES_TO = 2.0
#: Places of the objectives that are drawn: those of painting that no flight has at 0.
DRAWN = [
    place
    for place, each in enumerate(OBJECTIVES)
    if each.name in ("force_rms_n", "path_rms_m", "tilt_peak_deg", "yaw_peak_deg", "jitter_n_s")
]


def draw_front(law: str, scores: dict[int, Score], shipped: Score, chosen: int | None) -> Figure:
    """Every pair of the drawn objectives: trials, Pareto front, the shipped and the chosen preset."""
    best = front(scores)
    shown = {"trial": (FAINT, "o", 9, _points(each for each in scores.values() if not each.failed))}
    shown["on the front of all objectives"] = (law_colour(law), "o", 14, _points(scores[number] for number in best))
    shown["shipped"] = ("#222222", "x", 60, _points([shipped]))
    if chosen is not None:
        shown["chosen"] = ("#d4a017", "*", 90, _points([scores[chosen]]))
    labels, ends = [OBJECTIVES[place].label for place in DRAWN], _AXES_TO * _points([shipped])[0]
    figure, last = new_figure(7.0), len(DRAWN) - 1
    grid = figure.subplots(last, last, sharex="col", sharey="row", squeeze=False)
    for (row, column), axes in np.ndenumerate(grid):
        if column > row:
            axes.remove()
            continue
        for label, (colour, marker, size, points) in shown.items():
            axes.scatter(points[:, column], points[:, row + 1], size, colour, marker=marker, label=label)
        axes.set(xlim=(0.0, ends[column]), ylim=(0.0, ends[row + 1]))
        axes.set_xlabel(labels[column] if row == last - 1 else "")
        axes.set_ylabel(labels[row + 1] if column == 0 else "")
    figure.legend(*grid[0, 0].get_legend_handles_labels(), loc="outside upper right", ncols=4)
    figure.suptitle(f"{law_name(law)}, {len(scores)} trials", x=0.01, ha="left", fontsize=9, fontweight="bold")
    return figure


def _points(scores: Iterable[Score]) -> np.ndarray:
    """Drawn objectives of some scores in the units of their labels, (scores, objectives)."""
    scales = [OBJECTIVES[place].scale for place in DRAWN]
    return np.array([each.values for each in scores]).reshape(-1, len(OBJECTIVES))[:, DRAWN] * scales


def draw_unseen(law: str, table: pl.DataFrame) -> Figure:
    """Tuned over shipped, flight by flight; below 1 the tuned preset is better."""
    both, figure = paired(table), new_figure(2.6)
    axes = figure.subplots()
    for place, each in enumerate(OBJECTIVES[number] for number in DRAWN):
        ratios = (both[f"{each.name}.{TUNED}"].cast(float) / both[each.name].cast(float)).drop_nulls().to_numpy()
        draw_boxes(axes, [ratios[np.isfinite(ratios)]], [place], 0.5, law)
    axes.axhline(1.0, **REFERENCE)
    axes.set_xticks(range(len(DRAWN)), [OBJECTIVES[place].label.replace(", ", ",\n") for place in DRAWN])
    axes.set(ylabel="tuned over shipped", title=f"{law_name(law)}, unseen seeds")
    return figure
