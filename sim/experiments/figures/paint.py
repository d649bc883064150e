"""The six panels of the complete demonstration, and the spread of thirty seeds."""

from __future__ import annotations

from typing import TYPE_CHECKING

from matplotlib.figure import Figure

from sim.experiments.figures.common import kept_trace, select
from sim.experiments.figures.demonstration import draw_demonstration
from sim.experiments.figures.snapshots import draw_snapshots
from sim.figures.style import law_colour, law_name, new_figure

if TYPE_CHECKING:
    from sim.experiments.base import Results

_LAWS = ("qp", "paper")
#: Figures of the spread: name, label, factor.
_SPREAD = (
    ("path_rms_straight_m", "path, straights\nrms [mm]", 1e3),
    ("path_rms_corner_m", "path, corners\nrms [mm]", 1e3),
    ("force_rms_straight_n", "push, straights\nrms [N]", 1.0),
    ("force_rms_corner_n", "push, corners\nrms [N]", 1.0),
    ("tilt_rms_deg", "tilt\nrms [deg]", 1.0),
)


def draw_paint(results: Results) -> dict[str, tuple[str, Figure]]:
    """Six panels per law, snapshots of the line detection, and the spread over seeds."""
    figures = {}
    for law in ("qp", "paper"):
        trace = kept_trace(results, select(results.table, law=law, variant="standard"))
        if trace is not None and len(trace.t):
            figures[f"demonstration-{law}"] = (
                f"The complete demonstration, {law_name(law)}",
                draw_demonstration(trace),
            )
            if law == "qp":
                caption = (
                    "Line detection at three moments; below, normals of the depth picture and the bounding box of the "
                    "plane found, both computed for this figure"
                )
                figures["line-detection"] = (caption, draw_snapshots(trace))
    if results.table["seed"].n_unique() > 1:
        figures["paint-spread"] = ("Spread over the seeds, box plots", _spread(results))
    return figures


def _spread(results: Results) -> Figure:
    figure = new_figure(2.5)
    for axes, (name, label, scale) in zip(figure.subplots(1, len(_SPREAD)), _SPREAD, strict=True):
        for place, law in enumerate(_LAWS):
            rows = select(results.table, law=law, variant="standard")
            values = scale * rows[name].drop_nulls().to_numpy()
            boxes = axes.boxplot(
                [values],
                positions=[place],
                widths=0.6,
                patch_artist=True,
                manage_ticks=False,
                medianprops={"color": "#222222"},
                flierprops={"markersize": 3, "marker": "."},
            )
            boxes["boxes"][0].set(facecolor=law_colour(law), alpha=0.5, linewidth=0.6)
        axes.set(title=label, ylim=(0.0, None))
        flown = [select(results.table, law=law, variant="standard")[name].drop_nulls().len() for law in _LAWS]
        axes.set_xticks(
            [0, 1], [f"{words}\nn = {count}" for words, count in zip(("QP", "analytic"), flown, strict=True)]
        )
        axes.grid(visible=False, axis="x")
    return figure
