"""Style sheet, colours, panels, phase shading and legends of all figures."""

from __future__ import annotations

import contextlib
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.transforms import blended_transform_factory
from numpy.typing import ArrayLike

from sim.flight.trace import Trace, law_name
from sim.storage.atomic import replacing

STYLE_FILE = Path(__file__).with_name("ibvs_qp.mplstyle")
#: One colour per law, distinguishable by colour-blind readers (Okabe and Ito).
LAW_COLOURS = {"qp": "#0b6f9e", "paper": "#d55e1a"}
REFERENCE = {"color": "#333333", "linestyle": (0, (4, 2)), "linewidth": 0.9}
ZERO = {"color": "#333333", "linewidth": 0.6}
FAINT, GREY = "#b9c4cc", "#777777"
#: Tints of the phases with contact.
PHASE_TINTS = {"press": "#f1ead9", "paint": "#e3eef5", "retouch": "#f3dfe4", "climb": "#cfe3d3"}
#: Width of one letter of a phase's label as a fraction of a page-wide axis; shorter phases get no label.
LETTER_FRACTION = 0.0125
#: Largest number of points per curve; more would only enlarge the file.
MOST_POINTS = 6000


@contextlib.contextmanager
def styled() -> Iterator[None]:
    """Apply the style sheet within a context; the user's settings do not change."""
    with matplotlib.rc_context(fname=STYLE_FILE):
        yield


def new_figure(height_in: float) -> Figure:
    """Empty figure of the page's width, independent of any global state."""
    figure = Figure(figsize=(matplotlib.rcParams["figure.figsize"][0], height_in))
    FigureCanvasAgg(figure)
    return figure


def law_panels(
    traces: dict[str, Trace], height_in: float, **subplots: Any
) -> tuple[Figure, list[tuple[Axes, str, Trace]]]:
    """Figure with one panel per law, one above the other, titled with the law's name.

    Args:
        traces: One flight per law.
        height_in: Height of the figure [in].
        subplots: Further arguments of `Figure.subplots`.

    Returns:
        The figure, and the axes with law and flight of every panel.
    """
    figure = new_figure(height_in)
    panels = figure.subplots(len(traces), 1, squeeze=False, **subplots)[:, 0]
    for axes, law in zip(panels, traces, strict=True):
        axes.set_title(law_name(law))
    return figure, [(axes, law, trace) for axes, (law, trace) in zip(panels, traces.items(), strict=True)]


def law_colour(law: str) -> str:
    """Colour of a law in every figure."""
    return LAW_COLOURS.get(law, "#555555")


def thin(*columns: np.ndarray) -> list[np.ndarray]:
    """The same columns with at most `MOST_POINTS` evenly spaced rows."""
    step = max(1, len(columns[0]) // MOST_POINTS)
    return [column[::step] for column in columns]


def runs(*columns: np.ndarray) -> list[tuple[int, int]]:
    """(first, last) index of every stretch in which no column changes, in order."""
    change = np.flatnonzero(np.any([np.diff(column) != 0 for column in columns], axis=0)) + 1
    starts = np.concatenate(([0], change))
    return list(zip(starts.tolist(), [*(change - 1).tolist(), len(columns[0]) - 1], strict=True))


def shade_phases(axes: Axes, trace: Trace, labels: bool = True, columns: int = 1) -> None:
    """Tint the contact phases behind a time series and label the long phases at the top.

    Args:
        axes: Axes with time [s] along x.
        trace: The flight.
        labels: Whether to label the phases.
        columns: Number of axes side by side on the page.
    """
    t = trace.t
    place = blended_transform_factory(axes.transData, axes.transAxes)
    for first, last in runs(trace.phase, trace.row) if len(t) else ():
        begin, end = float(t[first]), float(t[min(last + 1, len(t) - 1)])
        phase = trace.phases[int(trace.phase[first])]
        if phase in PHASE_TINTS:
            axes.axvspan(begin, end, color=PHASE_TINTS[phase], linewidth=0, zorder=0)
        text = f"row {int(trace.row[first])}" if phase == "paint" else phase
        if labels and end - begin > LETTER_FRACTION * columns * len(text) * (t[-1] - t[0]):
            axes.text((begin + end) / 2, 0.985, text, transform=place, ha="center", va="top", fontsize=7, color=GREY)
    axes.set_xlim(0.0, max(float(t[-1]) if len(t) else 1.0, 1e-3))


def legend_above(axes: Axes) -> None:
    """Put the legend above the axes at the right, where it covers no data."""
    count = len(axes.get_legend_handles_labels()[0])
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 0.99), ncols=count, borderaxespad=0.1)


def legend_below(figure: Figure, handles: Sequence[Artist] | None = None, columns: int = 4, **style: Any) -> None:
    """Put one legend below all panels: of these handles, or of all curves with a label."""
    entries: dict[str, Artist] = {str(handle.get_label()): handle for handle in handles or ()}
    for axes in figure.axes if handles is None else ():
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            entries.setdefault(label, handle)
    if entries:
        figure.legend(list(entries.values()), list(entries), loc="outside lower center", ncols=columns, **style)


def note_empty(axes: Axes, text: str) -> None:
    """Write in the middle of the axes why they show no data."""
    axes.text(0.5, 0.5, text, transform=axes.transAxes, ha="center", va="center", color=GREY)


def draw_boxes(axes: Axes, values: Sequence[np.ndarray], places: ArrayLike, width: float, law: str) -> None:
    """Box plots of one law at places along x; outliers are dots."""
    drawn = axes.boxplot(
        values,
        positions=np.atleast_1d(places).tolist(),
        widths=width,
        patch_artist=True,
        manage_ticks=False,
        medianprops={"color": "#222222"},
        flierprops={"markersize": 3, "marker": "."},
        boxprops={"linewidth": 0.6},
    )
    for box in drawn["boxes"]:
        box.set(facecolor=law_colour(law), alpha=0.5)


def law_patches(laws: Iterable[str] = ("qp", "paper")) -> list[Patch]:
    """Legend entries of the boxes of `draw_boxes`."""
    return [Patch(facecolor=law_colour(law), alpha=0.5, label=law_name(law)) for law in laws]


def save(figure: Figure, file: Path) -> Path:
    """Write a figure as PNG and return its path."""
    with replacing(file) as stream:
        figure.savefig(stream, format="png")
    return file
