"""Empty figures of the site's size."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure


def panels(height: float = 3.0, columns: int = 1) -> tuple[Figure, list[Axes]]:
    """Panels side by side, as wide as the site's text; height in inches."""
    figure = Figure(figsize=(7.6, height), layout="constrained")
    axes = list(np.atleast_1d(figure.subplots(1, columns)))
    for one in axes:
        one.spines[["top", "right"]].set_visible(False)
    return figure, axes
