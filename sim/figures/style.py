"""What all figures share: style sheet, colours of the laws, phase shading, saving."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.transforms import blended_transform_factory

from sim.flight.trace import Trace

STYLE_FILE = Path(__file__).with_name("ibvs_qp.mplstyle")
#: Colours that stay apart for colour-blind readers (Okabe and Ito), one per law.
LAW_COLOURS = {"qp": "#0b6f9e", "paper": "#d55e1a"}
LAW_NAMES = {"qp": "QP law", "paper": "analytic law"}
REFERENCE = {"color": "#333333", "linestyle": (0, (4, 2)), "linewidth": 0.9}
FAINT = "#b9c4cc"
#: Phases in which the brush is on the board are tinted, each with its own tint.
PHASE_TINTS = {"press": "#f1ead9", "paint": "#e3eef5", "climb": "#cfe3d3"}
#: Share of a page-wide axis that one letter of a phase's label takes; a phase too short for its label gets none.
LETTER_SHARE = 0.0125
#: Points drawn per curve at most; more only makes the file larger.
MOST_POINTS = 6000


@contextlib.contextmanager
def styled() -> Iterator[None]:
    """Apply the style sheet for the duration of a context, without touching the user's settings."""
    with matplotlib.rc_context(fname=STYLE_FILE):
        yield


def new_figure(height_in: float) -> Figure:
    """Empty figure of the page's width, independent of any global state."""
    figure = Figure(figsize=(matplotlib.rcParams["figure.figsize"][0], height_in))
    FigureCanvasAgg(figure)
    return figure


def law_name(law: str) -> str:
    """Name of a law in titles and legends."""
    return LAW_NAMES.get(law, law)


def law_colour(law: str) -> str:
    """Colour of a law in every figure."""
    return LAW_COLOURS.get(law, "#555555")


def thin(*columns: np.ndarray) -> list[np.ndarray]:
    """The same columns with at most `MOST_POINTS` evenly chosen rows."""
    step = max(1, len(columns[0]) // MOST_POINTS)
    return [column[::step] for column in columns]


def phase_spans(trace: Trace) -> list[tuple[float, float, str, int]]:
    """(begin, end, phase, row) of every stretch in one phase and row, in order [s]."""
    if not len(trace.t):
        return []
    change = np.flatnonzero(np.diff(trace.phase) | np.diff(trace.row)) + 1
    starts = np.concatenate(([0], change))
    ends = np.concatenate((trace.t[change], trace.t[-1:]))
    return [
        (float(trace.t[i]), float(end), trace.phases[int(trace.phase[i])], int(trace.row[i]))
        for i, end in zip(starts, ends, strict=True)
    ]


def shade_phases(axes: Axes, trace: Trace, labels: bool = True, columns: int = 1) -> None:
    """Tint the contact phases behind a time series and name the long ones at the top.

    Args:
        axes: Where.
        trace: Whose phases.
        labels: Whether to name them.
        columns: Number of axes side by side on the page.
    """
    spans = phase_spans(trace)
    whole = (spans[-1][1] - spans[0][0]) if spans else 0.0
    place = blended_transform_factory(axes.transData, axes.transAxes)
    for begin, end, phase, row in spans:
        if phase in PHASE_TINTS:
            axes.axvspan(begin, end, color=PHASE_TINTS[phase], linewidth=0, zorder=0)
        text = f"row {row}" if phase == "paint" else phase
        if labels and end - begin > LETTER_SHARE * columns * len(text) * whole:
            axes.text(
                (begin + end) / 2, 0.985, text, transform=place, ha="center", va="top", fontsize=7, color="#777777"
            )
    axes.set_xlim(0.0, max(float(trace.t[-1]) if len(trace.t) else 1.0, 1e-3))


def legend_above(axes: Axes) -> None:
    """Put the legend at the top right, outside, where it covers no data."""
    count = len(axes.get_legend_handles_labels()[0])
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 0.99), ncols=count, borderaxespad=0.1)


def save(figure: Figure, file: Path) -> Path:
    """Write a figure as PNG and return its path."""
    file.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(file)
    return file
