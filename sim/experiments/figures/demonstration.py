"""Six panels of the complete demonstration: board, path of the tip, push, visual target, velocity, attitude."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.gridspec import GridSpec
from matplotlib.patches import Patch, Rectangle

from sim.evaluate.window import in_phase
from sim.experiments.figures.common import Drawn, Results, stored_trace
from sim.experiments.figures.snapshots import draw_snapshots, painted_board
from sim.experiments.spec import FigureSpec
from sim.figures.board import draw_canvas
from sim.figures.style import PHASE_TINTS, REFERENCE, law_colour, law_name, new_figure, shade_phases, thin
from sim.flight.trace import Trace
from sim.sweep.statistics import select
from sim.world.board import BoardGeometry

#: Colours of quantities other than the law's own: true values under estimates, and the second and third axis.
TRUE, SECOND, THIRD = "#f0a94b", "#333333", "#9a4f8f"
#: The attitude is shown at least to this angle [deg]; greater ones widen the axis.
LEAST_ANGLE_DEG = 1.0
#: Where a metre off the wall is drawn, along and up [m]: the height has a scale of its own and shows its millimetres.
OBLIQUE = (1.2, -0.3)
#: A longer board gets fewer ticks [m].
LONG_M = 1.5
#: Free space above the curves for their legend, as a fraction of their range.
HEADROOM = 0.2
_WORDS = {
    "press": "touch and press",
    "paint": "painting a row",
    "retouch": "painting it again",
    "climb": "climb to the next row",
}


def draw_demonstrations(spec: FigureSpec, results: Results) -> Drawn:
    """Six panels per law, and snapshots of the line detection under the QP law."""
    figures: Drawn = {}
    for law in ("qp", "paper"):
        trace = stored_trace(results, select(results.table, spec.where, law=law, variant="standard"))
        if trace is None or not len(trace.t):
            continue
        figures[f"demonstration-{law}"] = (f"The complete demonstration, {law_name(law)}", draw_demonstration(trace))
        if law == "qp":
            caption = (
                "Line detection at three moments; below, normals of the depth picture and the bounding box of the "
                "plane found, both computed for this figure"
            )
            figures["line-detection"] = (caption, draw_snapshots(trace))
    return figures


def draw_demonstration(trace: Trace) -> Figure:
    """Six panels of one paint job with rendered pictures; tints mark the phases."""
    figure = new_figure(7.6)
    grid = GridSpec(4, 2, figure, height_ratios=(1.12, 1.3, 1.0, 0.85))
    _board(figure.add_subplot(grid[0, :]), trace)
    _trajectory(figure.add_subplot(grid[1, 0]), trace)
    force, visual = figure.add_subplot(grid[1, 1]), figure.add_subplot(grid[2, 0])
    speed, attitude = figure.add_subplot(grid[2, 1]), figure.add_subplot(grid[3, :])
    for axes in (force, visual, speed, attitude):
        shade_phases(axes, trace, labels=False)
    _force(force, trace)
    _visual(visual, trace)
    _speed(speed, trace)
    _attitude(attitude, trace)
    for axes in (visual, speed, attitude):
        low, high = axes.get_ylim()
        below = HEADROOM if axes is visual else 0.0  # for its note
        axes.set_ylim(low - below * (high - low), high + HEADROOM * (high - low))
        axes.legend(loc="upper center", ncols=3, borderaxespad=0.2, handlelength=1.4, columnspacing=1.0, fontsize=7)
    attitude.set_xlabel("time [s]")
    flown = [name for name in PHASE_TINTS if in_phase(trace, name).any()]
    tints = [Patch(facecolor=PHASE_TINTS[name], edgecolor="#bbbbbb", linewidth=0.4) for name in flown]
    figure.legend(tints, [_WORDS[name] for name in flown], loc="outside lower center", ncols=len(flown))
    return figure


def _board(axes: Axes, trace: Trace) -> None:
    scene = trace.scene
    axes.imshow(painted_board(trace), extent=(0.0, scene.board.width_m, 0.0, scene.board.height_m))
    draw_canvas(axes, trace)
    paint = scene.paint
    top = paint.edge_margin_m + (BoardGeometry(scene).strokes - 1) * paint.pitch_m + paint.brush_width_m
    axes.set(ylim=(0.0, min(scene.board.height_m, top)), title="(a) the board afterwards; white: path of the tip")
    axes.set_ylabel("up [m]")
    axes.set_xlabel("along the board [m]", labelpad=1.0)


def _trajectory(axes: Axes, trace: Trace) -> None:
    """Oblique view: the wall lies in the page, points off the wall go down to the right."""
    along, up = BoardGeometry(trace.scene).board_coordinates(trace.tip[:, 1:]).T
    off = np.maximum(-trace.tip[:, 0], 0.0)
    width = trace.scene.board.width_m
    top = float(np.max(up)) + trace.scene.paint.edge_margin_m
    deepest = float(np.max(off))
    axes.add_patch(Rectangle((0.0, 0.0), width, top, facecolor="#f0efe9", edgecolor="#aaaaaa", linewidth=0.6))
    corner = np.array([0.0, deepest])
    axes.plot(width + OBLIQUE[0] * corner, OBLIQUE[1] * corner, color="#888888", linewidth=0.6)
    for mark in np.arange(0.1, deepest, 0.1):
        axes.plot(width + OBLIQUE[0] * mark, OBLIQUE[1] * mark, "|", color="#888888", markersize=4)
        axes.annotate(f"{mark:g}", (width + OBLIQUE[0] * mark, OBLIQUE[1] * mark), (5, 2), color="#555555",
                      textcoords="offset points", fontsize=7)  # fmt: skip
    axes.text(width + OBLIQUE[0] * deepest, OBLIQUE[1] * deepest, "off the wall [m]   ", ha="right", va="center",
              fontsize=7, color="#333333")  # fmt: skip
    x, y = along + OBLIQUE[0] * off, up + OBLIQUE[1] * off
    axes.plot(x[::10], y[::10], color=law_colour(trace.law), linewidth=1.1)
    for tick, marker, words, drop in ((0, "o", "start", -9), (-1, "s", "end", 0)):
        axes.plot(x[tick], y[tick], marker, color=SECOND, markersize=4)
        axes.annotate(words, (x[tick], y[tick]), (5, drop), textcoords="offset points", fontsize=7, va="center")
    axes.set(title="(b) path of the tip, not to scale", xlabel="along the board [m]", ylabel="up [m]")
    axes.set_xticks(np.arange(0.0, width + 1e-9, 0.2 if width < LONG_M else 0.5))
    axes.set_xlim(0.0, 1.06 * (width + OBLIQUE[0] * deepest))
    axes.set_yticks(np.arange(0.0, top, 0.1))
    axes.grid(False)


def _force(axes: Axes, trace: Trace) -> None:
    _plot(axes, trace, trace.push_true, "true push", color=law_colour(trace.law), linewidth=0.8)
    _plot(axes, trace, trace.push_reference, "reference", **REFERENCE)
    axes.set(title="(c) push", ylabel="[N]")
    axes.legend(loc="lower center", ncols=1)


def _visual(axes: Axes, trace: Trace) -> None:
    _plot(axes, trace, trace.line_error_px[:, 0], "level edge", color=law_colour(trace.law))
    _plot(axes, trace, trace.line_error_px[:, 1], "upright edge", color=THIRD)
    axes.set(title="(d) visual target: edge error at the tip", ylabel="[px]")
    note = "steps at a climb: the reference moves to the next row"
    axes.text(0.99, 0.03, note, transform=axes.transAxes, ha="right", va="bottom", fontsize=7, color="#555555")


def _speed(axes: Axes, trace: Trace) -> None:
    for axis, words, shade in ((1, "right", law_colour(trace.law)), (2, "down", SECOND)):
        _plot(
            axes, trace, trace.velocity_estimate[:, axis], f"{words}, estimated", color=shade, linewidth=1.8, alpha=0.55
        )
        _plot(axes, trace, trace.velocity[:, axis], "true" if axis == 2 else None, color=TRUE, linewidth=0.6)
    axes.set(title="(e) velocity along the wall", ylabel="[m/s]")


def _attitude(axes: Axes, trace: Trace) -> None:
    angles = np.degrees(np.unwrap(trace.euler, axis=0))
    for axis, words, colour in ((0, "roll", SECOND), (1, "pitch", law_colour(trace.law)), (2, "yaw", THIRD)):
        _plot(axes, trace, angles[:, axis], words, color=colour)
    widest = max(LEAST_ANGLE_DEG, 1.05 * float(np.nanmax(np.abs(angles))))
    axes.set(title="(f) attitude", ylabel="[deg]", ylim=(-widest, widest))


def _plot(axes: Axes, trace: Trace, values: np.ndarray, label: str | None, **style: Any) -> None:
    """A thinned time series."""
    axes.plot(*thin(trace.t, values), label=label, **{"linewidth": 0.9, **style})
