"""The painted board, the overview of a run, and the path of the brush tip."""

from __future__ import annotations

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from sim.evaluate.paint_plan import CORNER_M, band_mask, nominal_plan, path_error
from sim.evaluate.part import Part
from sim.evaluate.window import board_tip
from sim.figures.style import REFERENCE, law_colour, law_panels, legend_above, new_figure, shade_phases, thin
from sim.flight.pictures import unpack_picture
from sim.flight.trace import Trace, law_name
from sim.world.board import BoardGeometry

#: Width of the axes, height of a title, largest height of a panel [in].
_WIDTH_IN, _TITLE_IN, _MOST_HEIGHT_IN = 7.4, 0.45, 2.9


def draw_board(traces: dict[str, Trace]) -> Figure:
    """One panel per law: painted board, path of the tip, outline of the intended band."""
    board = next(iter(traces.values())).scene.board
    height = min(_WIDTH_IN * board.height_m / board.width_m + _TITLE_IN, _MOST_HEIGHT_IN)
    figure, panels = law_panels(traces, height * len(traces))
    for axes, law, trace in panels:
        draw_canvas(axes, trace)
        covered = f": {100 * Part.whole(trace).coverage:.1f} % of the intended band covered"
        axes.set_title(law_name(law) + (covered if trace.legs is None else ""))
    return figure


def draw_canvas(axes: Axes, trace: Trace) -> None:
    """Draw the board in its own coordinates [m]."""
    scene = trace.scene
    extent = (0.0, scene.board.width_m, 0.0, scene.board.height_m)
    if trace.canvas is not None:
        axes.imshow(trace.canvas, extent=extent, interpolation="bilinear", zorder=0)
    if trace.canvas is not None and trace.legs is None:
        shape = trace.canvas.shape[:2]
        band = band_mask(scene, nominal_plan(scene), shape, trace.canvas_px_per_m)
        axes.contour(band[::-1], levels=[0.5], extent=extent, colors=[REFERENCE["color"]],
                     linewidths=0.7, linestyles="dashed")  # fmt: skip
    along, up = thin(*board_tip(trace)[trace.row > 0].T)
    axes.plot(along, up, color="white", linewidth=0.7, path_effects=[withStroke(linewidth=1.5, foreground="#444444")])
    axes.set(xlabel="along the board [m]", ylabel="up [m]", xlim=extent[:2], ylim=extent[2:])
    axes.set_aspect("equal")
    axes.grid(False)
    for spine in axes.spines.values():
        spine.set_visible(True)


#: The camera view is taken at this fraction of the last row.
FRACTION_OF_ROW = 0.35


def draw_overview(traces: dict[str, Trace]) -> Figure:
    """Camera view and painted board of the first law, push force of all."""
    law, trace = next(iter(traces.items()))
    figure = new_figure(4.35)
    upper, lower = figure.subfigures(2, 1, squeeze=False, height_ratios=[1.42, 1])[:, 0]
    picture = _picture(trace)
    widths = [1.75] if picture is None else [1, 1.75]
    panels = upper.subplots(1, len(widths), squeeze=False, width_ratios=widths)[0]
    if picture is not None:
        panels[0].imshow(unpack_picture(picture))
        panels[0].set_axis_off()
        panels[0].set_title("camera view")
    draw_canvas(panels[-1], trace)
    panels[-1].set_title(f"painted board, {law_name(law)}")
    axes = lower.subplots()
    shade_phases(axes, trace)
    for name, flight in traces.items():
        t, push = thin(flight.t, flight.push_true)
        axes.plot(t, push, color=law_colour(name), label=law_name(name))
    axes.plot(*thin(trace.t, trace.push_reference), **REFERENCE, label="reference")
    top = 1.5 * max(float(trace.push_reference.max()), 1.0)
    axes.set(title="push on the board", xlabel="time [s]", ylabel="push [N]", ylim=(-0.05 * top, top))
    axes.set_xlim(0.0, max(float(flight.t[-1]) for flight in traces.values()))
    legend_above(axes)
    return figure


def _picture(trace: Trace) -> np.ndarray | None:
    """A picture of the last row, or the latest before it; None without pictures."""
    painting = [picture for _, picture, phase in trace.pictures if phase.startswith("paint")]
    if not painting:
        return trace.pictures[-1][1] if trace.pictures else None
    rows = BoardGeometry(trace.scene).strokes
    return painting[min(int((rows - 1 + FRACTION_OF_ROW) / rows * len(painting)), len(painting) - 1)]


def draw_path(traces: dict[str, Trace]) -> Figure:
    """Tip path in space with board and nominal polyline; below it the path error over the painted distance."""
    figure = new_figure(5.6)
    parts = figure.subfigures(2, 1, squeeze=False, height_ratios=[2.1, 1])
    _draw_space(parts[0, 0], traces)
    _draw_error(parts[1, 0].subplots(), traces)
    return figure


def _draw_space(figure, traces: dict[str, Trace]) -> None:
    """View from behind the vehicle; axes right, into the wall, up [m]."""
    scene = next(iter(traces.values())).scene
    board = BoardGeometry(scene)
    axes = figure.add_axes((0.0, -0.02, 1.0, 1.04), projection="3d")
    width, height = scene.board.width_m, scene.board.height_m
    corners = board.point(np.array([0.0, width, width, 0.0]), np.array([0.0, 0.0, height, height]))
    face = [(y, 0.0, -z) for y, z in corners]
    axes.add_collection3d(Poly3DCollection([face], facecolor="#f4f2ea", edgecolor="#a9a492", linewidth=0.8))
    if all(trace.legs is None for trace in traces.values()):  # a strategy of the user's has a path of its own
        nominal = board.point(*nominal_plan(scene).polyline.T)
        axes.plot(nominal[:, 0], 0 * nominal[:, 0], -nominal[:, 1], **REFERENCE, label="nominal polyline", zorder=5)
    for law, trace in traces.items():
        (tip,) = thin(trace.tip)
        colour, name = law_colour(law), law_name(law)
        axes.plot(tip[:, 1], tip[:, 0], -tip[:, 2], color=colour, linewidth=0.9, label=name, zorder=6)
        axes.scatter(*tip[0, [1]], tip[0, 0], -tip[0, 2], color=colour, s=12, depthshade=False)
    depth = max(0.3, *(float(np.max(-trace.tip[:, 0])) for trace in traces.values()))
    zoom = min(1.3, 0.6 * math.hypot(width, depth, height) / height)  # a tall board fits above the errors
    axes.set_box_aspect((width, depth, height), zoom=zoom)
    axes.set_xlabel("right [m]", labelpad=6)
    axes.set_ylabel("into the wall [m]", labelpad=2)
    axes.set_zlabel("up [m]", labelpad=2)
    axes.set_yticks(np.round(np.linspace(-depth, 0.0, 3), 1))
    axes.view_init(elev=20, azim=-62)
    for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
        axis.set_pane_color((1.0, 1.0, 1.0, 0.0))
    for artist in (*axes.lines, *axes.collections):
        artist.set_in_layout(False)
        artist.set_clip_on(False)  # the frame of 3-D axes is narrower than their content
    axes.legend(loc="upper left", bbox_to_anchor=(0.02, 0.97), bbox_transform=figure.transSubfigure)


def _draw_error(axes, traces: dict[str, Trace]) -> None:
    largest = 1.0
    for law, trace in traces.items():
        path = path_error(trace)
        if not path.painting.any() or trace.legs is not None:
            continue
        travelled, error = path.travelled, 1e3 * path.distance[path.painting]
        largest = max(largest, float(error.max()))
        axes.plot(*thin(travelled, error), color=law_colour(law), label=law_name(law))
        axes.fill_between(travelled, 0, 1, where=path.corner[path.painting], transform=axes.get_xaxis_transform(),
                          color="#efefef", linewidth=0, zorder=0)  # fmt: skip
    axes.set(xlabel="painted distance [m]", ylabel="path error [mm]", ylim=(0.0, 1.15 * largest))
    axes.set_title(f"distance of the tip to the nominal polyline (grey: within {CORNER_M:.2f} m of a vertex)")
    axes.margins(x=0.0)
