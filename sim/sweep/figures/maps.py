"""Heat maps: medians of a figure and shares of success over two parameters, and what depends on what."""

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

from sim.figures.style import law_name, new_figure
from sim.sweep.figures.shown import Figure, Levels, levels, rank_correlation

#: Colour maps: of a figure (dark is bad), of a difference (blue: QP law better), of a share.
FIGURE_MAP, DIFFERENCE_MAP, SHARE_MAP = "YlOrRd", "RdBu", "YlGn"
#: Height of a row of panels, of one cell, and of what stands around [in].
_ROW_IN, _CELL_IN, _AROUND_IN = 1.2, 0.22, 0.55
#: Levels up to which a cell's number is written into it.
_MOST_WRITTEN = 8
#: Letters of a row of tick labels that fit under a panel side by side.
_LETTERS = 24
#: Share of figures that the colours span: an outlier must not wash out the rest.
_COLOUR_QUANTILE = 0.95

#: Value of a cell from the rows in it.
CellValue = Callable[[np.ndarray], float]


def draw_figure_maps(table: pl.DataFrame, figure: Figure, columns: list[str]) -> Canvas:
    """Medians per law, and their difference where both fly."""
    values = figure.scale * table[figure.column].cast(pl.Float64).fill_null(float("nan")).to_numpy()

    def median(rows: np.ndarray) -> float:
        good = values[rows][np.isfinite(values[rows])]
        return float(np.median(good)) if len(good) else float("nan")

    return _draw(table, columns, median, figure.label, None)


def draw_success_maps(table: pl.DataFrame, columns: list[str]) -> Canvas:
    """Share of flights that ended as planned [%]."""
    completed = table["completed"].to_numpy()
    return _draw(
        table, columns, lambda rows: 100.0 * float(completed[rows].mean()), "ended as planned [%]", (0.0, 100.0)
    )


def _draw(
    table: pl.DataFrame, columns: list[str], value: CellValue, label: str, span: tuple[float, float] | None
) -> Canvas:
    laws = [law for law in ("qp", "paper") if law in table["law"].unique()]
    sorted_in = [levels(table, column) for column in columns]
    law_levels = Levels(
        "law", "", tuple(law_name(law) for law in laws), np.array([laws.index(x) for x in table["law"]])
    )
    pairs = list(itertools.combinations(sorted_in, 2)) or [(sorted_in[0], law_levels)]
    law_of = table["law"].to_numpy()
    parts = [np.ones(len(law_of), bool)] if len(columns) == 1 else [law_of == law for law in laws]
    titles = [law_name(law) for law in laws] if len(parts) > 1 or len(laws) == 1 else [""]
    both, heights = len(parts) == 2, [_ROW_IN + _CELL_IN * len(y.names) for _, y in pairs]
    canvas = new_figure(_AROUND_IN + sum(heights))
    grid = canvas.subplots(len(pairs), len(parts) + both, squeeze=False, height_ratios=heights)
    for row, (x, y) in zip(grid, pairs, strict=True):
        cells = [_cells(part, x, y, value) for part in parts]
        norm = Normalize(*(span or _span(cells)))
        shown = [
            _panel(axes, cell, x, y, norm, SHARE_MAP if span else FIGURE_MAP, title)
            for axes, cell, title in zip(row, cells, titles, strict=False)
        ]
        _bar(canvas, shown[0], list(row[: len(parts)]), label)
        if both:
            difference = cells[1] - cells[0]
            reach = np.nanmax(np.abs(difference), initial=1e-12) if np.isfinite(difference).any() else 1.0
            scale = TwoSlopeNorm(0.0, -reach, reach)
            colours = DIFFERENCE_MAP + ("_r" if span else "")
            _bar(canvas, _panel(row[-1], difference, x, y, scale, colours, "analytic - QP"), [row[-1]], "")
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


def _cells(part: np.ndarray, x: Levels, y: Levels, value: CellValue) -> np.ndarray:
    """Value of every cell, (levels of y, levels of x); NaN where nothing flew."""
    cells = np.full((len(y.names), len(x.names)), np.nan)
    for i, j in itertools.product(range(len(y.names)), range(len(x.names))):
        rows = part & (y.level == i) & (x.level == j)
        if rows.any():
            cells[i, j] = value(rows)
    return cells


def _panel(axes: Axes, cells: np.ndarray, x: Levels, y: Levels, norm: Normalize, colours: str, title: str) -> AxesImage:
    map_ = matplotlib.colormaps[colours].with_extremes(bad="#eeeeee")
    shown = axes.imshow(cells, origin="lower", aspect="auto", norm=norm, cmap=map_)
    turned = {"rotation": 40, "ha": "right", "rotation_mode": "anchor"} if sum(map(len, x.names)) > _LETTERS else {}
    axes.set_xticks(range(len(x.names)), x.names, **turned)
    axes.set_yticks(range(len(y.names)), y.names)
    axes.set_title(title)
    axes.set_xlabel(x.label)
    axes.set_ylabel(y.label)
    axes.tick_params(labelsize=7, length=0)
    axes.grid(visible=False)
    axes.spines[:].set_visible(False)
    if max(cells.shape) <= _MOST_WRITTEN:
        digits = max(0, 1 - math.floor(math.log10(max(norm.vmax or 0.0, 1e-12))))
        for (i, j), number in np.ndenumerate(cells):
            if np.isfinite(number):
                red, green, blue, _ = map_(norm(number))
                dark = 0.3 * red + 0.59 * green + 0.11 * blue < 0.5
                axes.text(j, i, f"{number:.{digits}f}", ha="center", va="center",
                          fontsize=6.5, color="white" if dark else "#222222")  # fmt: skip
    return shown


def _bar(canvas: Canvas, shown: AxesImage, beside: list[Axes], label: str) -> None:
    bar = canvas.colorbar(shown, ax=beside, pad=0.02, fraction=0.06)
    bar.outline.set_visible(False)  # type: ignore[operator]
    bar.ax.tick_params(labelsize=7)
    bar.set_label(label, fontsize=8)


def draw_dependence(table: pl.DataFrame, figures: list[Figure], columns: list[str]) -> Canvas | None:
    """Rank correlation of every parameter with every figure, per law; None where nothing can be said."""
    laws = [law for law in ("qp", "paper") if law in table["law"].unique()]
    found = [rank_correlation(table.filter(pl.col("law") == law), figures, columns) for law in laws]
    if not any(np.isfinite(each).any() for each in found):
        return None
    names = tuple(levels(table, column).label for column in columns)
    merits = (*(figure.words for figure in figures), "ended as planned")
    canvas = new_figure(1.3 + 0.26 * len(columns))
    grid = canvas.subplots(1, len(laws), squeeze=False)[0]
    x, y = Levels("", "", merits, np.array([])), Levels("", "", names, np.array([]))
    shown = [
        _panel(axes, each, x, y, TwoSlopeNorm(0.0, -1.0, 1.0), DIFFERENCE_MAP + "_r", law_name(law))
        for axes, law, each in zip(grid, laws, found, strict=True)
    ]
    for axes in grid[1:]:
        axes.set_yticklabels([])
    _bar(canvas, shown[0], list(grid), "rank correlation")
    return canvas
