"""Which limit was active when, and at what price."""

from __future__ import annotations

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.patheffects import withStroke

from sim.flight.trace import Trace

#: Limits shown at most, the dearest first.
MOST_ROWS = 7
#: Colour scale of the prices: decades below the dearest, its greatest end at least this.
DECADES, LEAST_TOP = 4.0, 1.0
#: Colours of the prices, and how many of them their scale shows.
COLOURS, SHADES = "viridis_r", 128
#: Rows of the picture per limit, and those of them that show the flight now and the flight before.
FINE_ROWS = 50
NOW_STRIP, LAST_STRIP = slice(4, 35), slice(37, 46)
#: Digits of an exponent.
RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
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
    norm = Normalize(math.log10(top) - DECADES, math.log10(top), clip=True)
    for (table, trace), strip in zip(flights, (NOW_STRIP, LAST_STRIP), strict=True):
        if any(name in table for name in names):
            extent = (float(trace.t[0]), float(trace.t[-1]), len(names) - 0.5, -0.5)
            axes.imshow(_strips(table, names, strip), extent=extent, aspect="auto", norm=norm, cmap=COLOURS,
                        interpolation="nearest")  # fmt: skip
    axes.set_ylim(len(names) - 0.5, -0.5)
    for place, name in enumerate(names):
        share = float(now.active[:, now.limits.index(name)].mean()) if name in now.limits else 0.0
        axes.text(0.005, place - 0.1, f"{name.replace('_', ' ')}  {100 * share:.1f} %", va="center", fontsize=6.8,
                  transform=axes.get_yaxis_transform(),
                  path_effects=[withStroke(linewidth=2.0, foreground="white")])  # fmt: skip
    _draw_scale(axes, norm)


def _strips(table: dict[str, np.ndarray], names: list[str], strip: slice) -> np.ma.MaskedArray:
    """Logarithms of the prices as one picture of `FINE_ROWS` rows per limit, of which `strip` are coloured."""
    prices = np.zeros((len(names), FINE_ROWS, len(next(iter(table.values())))))
    for row, name in zip(prices, names, strict=True):
        row[strip] = table.get(name, 0.0)
    return np.ma.log10(np.ma.masked_less_equal(prices.reshape(-1, prices.shape[2]), 0.0))


def _draw_scale(axes: Axes, norm: Normalize) -> None:
    """The colours' scale beside the axes, whose width stays; matplotlib's own bar takes three times as long."""
    assert axes.figure is not None and norm.vmin is not None and norm.vmax is not None
    place, low, high = axes.get_position(), norm.vmin, norm.vmax
    bar = axes.figure.add_axes((place.x1 + 0.004, place.y0, 0.008, place.height))
    shades = np.linspace(low, high, SHADES)[:, None]
    bar.imshow(shades, extent=(0.0, 1.0, low, high), origin="lower", aspect="auto", norm=norm, cmap=COLOURS)
    bar.grid(visible=False)
    bar.yaxis.tick_right()
    bar.yaxis.set_label_position("right")
    decades = range(math.ceil(low), math.floor(high) + 1)
    # Raised digits of the font: formulas are set by a parser.
    bar.set_yticks(list(decades), [f"10{str(decade).translate(RAISED)}" for decade in decades], fontsize=6.5)
    bar.set_xticks([])
    bar.set_ylabel("|d cost / d bound|", fontsize=7)
