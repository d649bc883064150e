"""Box plots and heat maps of figures of merit over parameters, success rates, and rank correlations."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable

import matplotlib
import numpy as np
import polars as pl
from matplotlib.axes import Axes
from matplotlib.colors import Normalize, TwoSlopeNorm
from matplotlib.figure import Figure as Canvas
from matplotlib.image import AxesImage

from sim.evaluate.figures import Figure
from sim.figures import style
from sim.figures.style import law_name, law_patches, new_figure
from sim.sweep.figures.levels import Levels, levels, parameter_label, rank_correlation

#: Fraction of a level's width for its boxes together, and height of a panel [in].
_WIDTH, _PANEL_IN = 0.76, 1.9
#: A figure with a spread wider than this ratio has a logarithmic axis.
_LOG_SPREAD = 30.0
#: Letters of a row of tick labels that fit side by side.
_BOX_LETTERS = 90


def draw_boxes(table: pl.DataFrame, figure: Figure, columns: list[str]) -> Canvas:
    """One panel per parameter."""
    laws = [law for law in ("qp", "paper") if law in table["law"].unique()]
    canvas, values, width = new_figure(0.45 + _PANEL_IN * len(columns)), figure.values(table), _WIDTH / len(laws)
    finite, law_of = np.isfinite(values), table["law"].to_numpy()
    good = values[finite & (values > 0.0)]
    wide = len(good) > 1 and np.quantile(good, 0.98) > _LOG_SPREAD * np.quantile(good, 0.02)
    for axes, column in zip(canvas.subplots(len(columns), 1, squeeze=False)[:, 0], columns, strict=True):
        sorted_in = levels(table, column)
        count = len(sorted_in.names)
        for place, law in enumerate(laws):
            rows = finite & (law_of == law)
            by_level = [values[rows & (sorted_in.level == level)] for level in range(count)]
            style.draw_boxes(
                axes, by_level, np.arange(count) + (place - 0.5 * (len(laws) - 1)) * width, 0.9 * width, law
            )
        axes.set_xticks(range(count), sorted_in.names)
        axes.tick_params(axis="x", labelsize=8 if sum(map(len, sorted_in.names)) < _BOX_LETTERS else 6.5)
        axes.set_xlabel(sorted_in.label)
        axes.grid(visible=False, axis="x")
        if wide:
            axes.set_yscale("log")
        else:
            axes.set_ylim(bottom=0.0)
    canvas.supylabel(figure.label, fontsize=8.5)
    canvas.axes[0].legend(handles=law_patches(laws), loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=len(laws))
    return canvas


#: Colour maps: of a figure (dark is bad), of a difference (blue: QP law better), of a success rate.
FIGURE_MAP, DIFFERENCE_MAP, SUCCESS_MAP = "YlOrRd", "RdBu", "YlGn"
#: Words of the success rate.
SUCCESS = "ended as planned"
#: Height of a row of panels, of one cell, and of the margins [in].
_ROW_IN, _CELL_IN, _MARGIN_IN = 1.2, 0.22, 0.55
#: Up to this number of levels the cells have printed numbers.
_MOST_PRINTED = 8
#: Most decimals of a printed number.
_MOST_DIGITS = 4
#: Letters of a row of tick labels that fit under a panel side by side.
_LETTERS = 24
#: Quantile of the figures at the end of the colour scale: an outlier must not wash out the rest.
_COLOUR_QUANTILE = 0.95

#: Median or mean of the flights of a cell.
Average = Callable[[np.ndarray], float]


def draw_figure_maps(table: pl.DataFrame, figure: Figure, columns: list[str]) -> Canvas:
    """Medians per law, and their difference where both fly."""
    return _draw(table, columns, figure.values(table), np.median, figure.label, None)


def draw_success_maps(table: pl.DataFrame, columns: list[str]) -> Canvas:
    """Percentage of flights that ended as planned."""
    return _draw(table, columns, 100.0 * table["completed"].to_numpy(), np.mean, f"{SUCCESS} [%]", (0.0, 100.0))


def _draw(
    table: pl.DataFrame,
    columns: list[str],
    values: np.ndarray,
    mean: Average,
    label: str,
    span: tuple[float, float] | None,
) -> Canvas:
    laws = [law for law in ("qp", "paper") if law in table["law"].unique()]
    law_of = table["law"].to_numpy()
    pairs = list(itertools.combinations([levels(table, column) for column in columns], 2))
    if pairs:
        parts, titles = [law_of == law for law in laws], [law_name(law) for law in laws]
    else:  # a single parameter: the laws are the other axis
        by_law = Levels("", tuple(map(law_name, laws)), np.array([laws.index(law) for law in law_of]))
        pairs, parts = [(levels(table, columns[0]), by_law)], [np.ones(len(law_of), bool)]
        titles = [law_name(laws[0]) if len(laws) == 1 else ""]
    both, heights = len(parts) == 2, [_ROW_IN + _CELL_IN * len(y.names) for _, y in pairs]
    canvas = new_figure(_MARGIN_IN + sum(heights))
    grid = canvas.subplots(len(pairs), len(parts) + both, squeeze=False, height_ratios=heights)
    for row, (x, y) in zip(grid, pairs, strict=True):
        cells = [_cells(part, x, y, values, mean) for part in parts]
        norm, colours = Normalize(*(span or _span(cells))), SUCCESS_MAP if span else FIGURE_MAP
        images = [
            _panel(axes, cell, title, x, y, norm, colours)
            for axes, cell, title in zip(row, cells, titles, strict=False)
        ]
        _bar(canvas, images[0], list(row[: len(parts)]), label)
        if both:
            difference = cells[1] - cells[0]
            reach = float(np.abs(difference[np.isfinite(difference)]).max(initial=0.0)) or 1.0
            scale, colours = TwoSlopeNorm(0.0, -reach, reach), DIFFERENCE_MAP + ("_r" if span else "")
            _bar(canvas, _panel(row[-1], difference, "analytic - QP", x, y, scale, colours), [row[-1]], "")
        for axes in row[1:]:
            axes.set_ylabel("")
            axes.set_yticklabels([])
    return canvas


def _span(cells: list[np.ndarray]) -> tuple[float, float]:
    good = np.concatenate([cell[np.isfinite(cell)] for cell in cells])
    if not len(good):
        return 0.0, 1.0
    low, high = float(good.min()), float(np.quantile(good, _COLOUR_QUANTILE))
    return (low, high) if high > low else (low - 0.5, low + 0.5)


def _cells(part: np.ndarray, x: Levels, y: Levels, values: np.ndarray, mean: Average) -> np.ndarray:
    """Median or mean of every cell, (levels of y, levels of x); NaN without flights."""
    cells = np.full((len(y.names), len(x.names)), np.nan)
    for i, j in np.ndindex(cells.shape):
        here = values[part & (y.level == i) & (x.level == j) & np.isfinite(values)]
        if len(here):
            cells[i, j] = mean(here)
    return cells


def _panel(axes: Axes, cells: np.ndarray, title: str, x: Levels, y: Levels, norm: Normalize, colours: str) -> AxesImage:
    map_ = matplotlib.colormaps[colours].with_extremes(bad="#eeeeee")
    image = axes.imshow(cells, origin="lower", aspect="auto", norm=norm, cmap=map_)
    turned = {"rotation": 40, "ha": "right", "rotation_mode": "anchor"} if sum(map(len, x.names)) > _LETTERS else {}
    axes.set_xticks(range(len(x.names)), x.names, **turned)
    axes.set_yticks(range(len(y.names)), y.names)
    axes.set(title=title, xlabel=x.label, ylabel=y.label)
    axes.tick_params(labelsize=7, length=0)
    axes.grid(visible=False)
    axes.spines[:].set_visible(False)
    if max(cells.shape) <= _MOST_PRINTED:
        digits = min(max(0, 1 - math.floor(math.log10(max(norm.vmax or 0.0, 1e-12)))), _MOST_DIGITS)
        for (i, j), number in np.ndenumerate(cells):
            if np.isfinite(number):
                luminance = np.dot(map_(norm(number))[:3], (0.3, 0.59, 0.11))
                axes.text(j, i, f"{number:.{digits}f}", ha="center", va="center",
                          fontsize=6.5, color="white" if luminance < 0.5 else "#222222")  # fmt: skip
    return image


def _bar(canvas: Canvas, image: AxesImage, beside: list[Axes], label: str) -> None:
    bar = canvas.colorbar(image, ax=beside, pad=0.02, fraction=0.06)
    bar.outline.set_visible(False)  # type: ignore[operator]
    bar.ax.tick_params(labelsize=7)
    bar.set_label(label, fontsize=8)


def draw_dependence(table: pl.DataFrame, figures: list[Figure], columns: list[str]) -> Canvas | None:
    """Rank correlation of every parameter with every figure, per law; None without any."""
    laws = [law for law in ("qp", "paper") if law in table["law"].unique()]
    found = [rank_correlation(table.filter(pl.col("law") == law), figures, columns) for law in laws]
    if not any(np.isfinite(each).any() for each in found):
        return None
    x = Levels("", (*(figure.words for figure in figures), SUCCESS), np.array([]))
    y = Levels("", tuple(map(parameter_label, columns)), np.array([]))
    canvas, norm = new_figure(1.3 + 0.26 * len(columns)), TwoSlopeNorm(0.0, -1.0, 1.0)
    grid = canvas.subplots(1, len(laws), squeeze=False)[0]
    images = [
        _panel(axes, each, law_name(law), x, y, norm, DIFFERENCE_MAP + "_r")
        for axes, law, each in zip(grid, laws, found, strict=True)
    ]
    for axes in grid[1:]:
        axes.set_yticklabels([])
    _bar(canvas, images[0], list(grid), "rank correlation")
    return canvas
