"""Common parts of the figures of several notebooks: shaded spans of time and curves of vectors."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from sim.figures.style import LAW_COLOURS

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
