"""Which limit was active when, and at what price."""

from __future__ import annotations

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.patheffects import withStroke

from sim.trace import Trace

#: Limits shown at most, the dearest first.
MOST_ROWS = 7
#: Colour scale of the prices: decades below the dearest, its greatest end at least this.
DECADES, LEAST_TOP = 4.0, 1.0
#: Ticks in one column of the picture; the dearest of them shows.
TICKS_PER_COLUMN = 5


def _columns(prices: np.ndarray) -> np.ndarray:
    """Greatest price within every few ticks, (limits, columns)."""
    whole = len(prices) // TICKS_PER_COLUMN * TICKS_PER_COLUMN
    return prices[:whole].reshape(-1, TICKS_PER_COLUMN, prices.shape[1]).max(axis=1).T


def draw_prices(axes: Axes, now: Trace, last: Trace) -> None:
    """One row per limit, coloured by its price; the thin strip under it is the flight before."""
    axes.set_title("active limits and their prices (thin: before)")
    axes.grid(visible=False)
    flights = [(dict(zip(trace.limits, _columns(trace.limit_price), strict=True)), trace) for trace in (now, last)]
    total = {name: float(row.sum()) for table, _ in reversed(flights) for name, row in table.items()}
    names = sorted(total, key=lambda name: -total[name])[:MOST_ROWS]
    axes.set(ylim=(max(len(names), 1) - 0.5, -0.5), yticks=[])
    if not names:
        axes.text(0.5, 0.5, "no limit was active", transform=axes.transAxes, ha="center", va="center", color="#777777")
        return
    top = max([LEAST_TOP, *(float(row.max(initial=0.0)) for table, _ in flights for row in table.values())])
    # Logarithms under a linear scale: a logarithmic one draws thirty small ticks.
    norm, image = Normalize(math.log10(top) - DECADES, math.log10(top), clip=True), None
    for (table, trace), (above, below) in zip(flights, ((-0.42, 0.2), (0.24, 0.42)), strict=True):
        for place, name in enumerate(names):
            if name in table:
                strip = np.ma.log10(np.ma.masked_less_equal(table[name][None, :], 0.0))
                extent = (float(trace.t[0]), float(trace.t[-1]), place + below, place + above)
                image = axes.imshow(strip, extent=extent, aspect="auto", norm=norm, cmap="viridis_r",
                                    interpolation="nearest")  # fmt: skip
    axes.set_ylim(len(names) - 0.5, -0.5)
    axes.set_yticks([])
    for place, name in enumerate(names):
        share = float(now.active[:, now.limits.index(name)].mean()) if name in now.limits else 0.0
        axes.text(0.005, place - 0.1, f"{name.replace('_', ' ')}  {100 * share:.1f} %", va="center", fontsize=6.8,
                  transform=axes.get_yaxis_transform(),
                  path_effects=[withStroke(linewidth=2.0, foreground="white")])  # fmt: skip
    if image is not None and axes.figure is not None:
        decades = range(math.ceil(norm.vmin or 0.0), math.floor(norm.vmax or 0.0) + 1)
        place = axes.get_position()
        beside = axes.figure.add_axes((place.x1 + 0.004, place.y0, 0.008, place.height))  # keeps the axes' width
        bar = axes.figure.colorbar(image, cax=beside, ticks=list(decades))
        bar.ax.set_yticklabels([f"$10^{{{decade}}}$" for decade in decades], fontsize=6.5)
        bar.set_label("|d cost / d bound|", fontsize=7)
