"""Common parts of the notebooks: curves, shaded spans, pictures, Markdown tables, and the short form of the tests."""

from __future__ import annotations

import base64
import io
import math
import os
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sim.evaluate.table import markdown
from sim.figures.style import LAW_COLOURS, styled

#: Colours of the two laws, of a third curve, and of a bound.
BLUE, ORANGE, GREEN, RED = LAW_COLOURS["qp"], LAW_COLOURS["paper"], "#3a8a4d", "#b3261e"
#: Tints of spans in contact and of spans with an active limit.
CONTACT, LIMITED = "#e3eef5", "#f4dfc8"
#: Rows of a wrench [Fx Fy Fz Mx My Mz] with their names.
FORCES, MOMENTS = {0: "front", 1: "right", 2: "down"}, {3: "roll", 4: "pitch", 5: "yaw"}


def wrench_curves(axes: Axes, t: np.ndarray, wrench: np.ndarray, rows: dict[int, str]) -> None:
    """Draw some rows of a wrench, (N, 6), over time."""
    for (row, name), colour in zip(rows.items(), (BLUE, GREEN, ORANGE), strict=True):
        axes.plot(t, wrench[:, row], color=colour, label=name, linewidth=0.9)
    axes.axhline(0.0, color="#333333", linewidth=0.5)


def shade(axes: Axes, t: np.ndarray, where: np.ndarray, colour: str, height: float = 1.0) -> None:
    """Tint spans of time behind the curves, from the bottom up to a fraction of the axes' height."""
    axes.fill_between(
        t, 0.0, height, where=where.tolist(), color=colour, transform=axes.get_xaxis_transform(), linewidth=0, zorder=0
    )


#: Text of a missing value.
MISSING = "–"


def number(value: float | None, form: str = ".2f", missing: str = MISSING) -> str:
    """Format a number; None, NaN and infinity become `missing`."""
    return format(value, form) if value is not None and math.isfinite(value) else missing


def table(header: Sequence[str], rows: Iterable[Sequence[object]], left: int = 1) -> str:
    """Build a markdown table.

    Args:
        header: Titles of the columns.
        rows: Cells of every row; numbers have the format of `number`.
        left: How many columns, from the first, are aligned left; the others are aligned right.
    """
    texts = ([number(cell) if isinstance(cell, float) else str(cell) for cell in line] for line in rows)
    return markdown(header, texts, range(left)).rstrip()


#: Resolution [dots per inch]: 880 px for a figure of the page's width.
DOTS_PER_INCH = 119.0


@dataclass(frozen=True)
class Picture:
    """A PNG image with its description."""

    png: bytes
    text: str = ""

    def _mime_(self) -> tuple[str, str]:
        """Representation for marimo."""
        return "image/png", "data:image/png;base64," + base64.b64encode(self.png).decode()

    def _repr_png_(self) -> bytes:
        """Representation for Jupyter."""
        return self.png


def picture(draw: Callable[..., Figure], *arguments: Any) -> Picture:
    """Call a drawing function within the style of all figures and convert its figure to a PNG.

    The first line of the function's docstring becomes the description.
    """
    file = io.BytesIO()
    with styled():
        draw(*arguments).savefig(file, format="png", dpi=DOTS_PER_INCH)
    return Picture(png=file.getvalue(), text=(draw.__doc__ or "").strip().split("\n")[0])


T = TypeVar("T")

#: Environment variable that selects the short form; any non-empty text does.
SHORT_VARIABLE = "IBVS_QP_NOTEBOOKS_SHORT"


def unless_short(full: T, short: T) -> T:
    """Return `full` for a reader and `short` for a test."""
    return short if os.environ.get(SHORT_VARIABLE) else full
