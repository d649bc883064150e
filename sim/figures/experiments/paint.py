"""The six panels of the complete demonstration, and the spread of thirty seeds."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sim.figures.experiments.common import kept_trace, select
from sim.figures.experiments.snapshots import draw_snapshots, final_view
from sim.figures.style import FAINT, REFERENCE, law_colour, law_name, new_figure, shade_phases, thin
from sim.trace import Trace

if TYPE_CHECKING:
    from sim.experiments.base import Results

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
            figures[f"demonstration-{law}"] = (f"The complete demonstration, {law_name(law)}", _panels(trace))
            if law == "qp":
                caption = "Line detection at three moments; below, wall normals and the bounding box of the plane"
                figures["line-detection"] = (caption, draw_snapshots(trace))
    if results.table["seed"].n_unique() > 1:
        figures["paint-spread"] = ("Spread over the seeds, box plots", _spread(results))
    return figures


def _panels(trace: Trace) -> Figure:
    figure = new_figure(6.6)
    grid = figure.subplots(3, 2, gridspec_kw={"height_ratios": (1.35, 1.0, 1.0)})
    _snapshot(grid[0][0], trace)
    _trajectory(figure, grid[0][1], trace)
    t, true, wanted = thin(trace.t, trace.push_true, trace.push_reference)
    colour = law_colour(trace.law)
    force, visual, speed, attitude = grid[1][0], grid[1][1], grid[2][0], grid[2][1]
    for axes in (force, visual, speed, attitude):
        shade_phases(axes, trace, labels=axes is force, columns=2)
    force.plot(t, true, color=colour, linewidth=0.8, label="true")
    force.plot(t, wanted, **REFERENCE, label="reference")
    force.set(title="(c) push", ylabel="[N]", xlabel="time [s]")
    for axis, dash, words in ((0, "-", "horizontal edge"), (1, ":", "vertical edge")):
        t, error = thin(trace.t, trace.line_error_px[:, axis])
        visual.plot(t, error, dash, color=colour, linewidth=0.8, label=words)
    visual.set(title="(d) visual target: edge error at the tip", ylabel="[px]", xlabel="time [s]")
    visual.legend(loc="upper right", ncols=2)
    for axis, words, shade in ((1, "right", colour), (2, "down", "#333333")):
        t, estimate, truth = thin(trace.t, trace.velocity_estimate[:, axis], trace.velocity[:, axis])
        speed.plot(t, truth, color=FAINT, linewidth=1.6)
        speed.plot(t, estimate, color=shade, linewidth=0.8, label=f"{words}, estimated")
    speed.set(title="(e) velocity along the wall (grey: true)", ylabel="[m/s]", xlabel="time [s]")
    speed.legend(loc="lower right", ncols=2)
    for axis, words, dash in ((0, "roll", "-"), (1, "pitch", "--"), (2, "yaw", ":")):
        t, angle = thin(trace.t, np.degrees(trace.euler[:, axis]))
        attitude.plot(t, angle, dash, color=colour, linewidth=0.9, label=words)
    attitude.set(title="(f) attitude", ylabel="[deg]", xlabel="time [s]", ylim=(-3.0, 3.0))
    attitude.legend(loc="upper right", ncols=3)
    return figure


def _snapshot(axes: Axes, trace: Trace) -> None:
    axes.imshow(final_view(trace))
    axes.set_anchor("W")
    axes.set(title="(a) the board afterwards, seen by the camera")
    axes.set_axis_off()


def _trajectory(figure: Figure, axes: Axes, trace: Trace) -> None:
    place = axes.get_subplotspec()
    axes.remove()
    space = figure.add_subplot(place, projection="3d")
    x, y, z = (column[::10] for column in trace.tip.T)
    space.plot(y, x, -z, color=law_colour(trace.law), linewidth=0.9)
    space.scatter([y[0]], [x[0]], [-z[0]], color="#333333", s=8)  # type: ignore[arg-type]
    for label, words in ((space.set_xlabel, "right"), (space.set_ylabel, "to wall"), (space.set_zlabel, "height")):
        label(f"{words} [m]", fontsize=6.5, labelpad=-9)  # type: ignore[call-arg]
    space.set_title("(b) path of the tip", x=0.0)
    space.view_init(elev=22, azim=-70)
    space.set_box_aspect((2.2, 1.0, 1.0), zoom=1.0)  # type: ignore[arg-type]
    space.tick_params(labelsize=5.5, pad=-4)
    space.locator_params(nbins=4)


def _spread(results: Results) -> Figure:
    figure = new_figure(2.5)
    for axes, (name, label, scale) in zip(figure.subplots(1, len(_SPREAD)), _SPREAD, strict=True):
        for place, law in enumerate(("qp", "paper")):
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
        axes.set_xticks([0, 1], ["QP", "analytic"])
        axes.grid(visible=False, axis="x")
    return figure
