"""Path of the brush tip in space, and its error over the painted distance."""

from __future__ import annotations

import math

import numpy as np
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from sim.evaluate.paint_plan import nominal_plan
from sim.evaluate.path_error import CORNER_M, path_error
from sim.figures.style import REFERENCE, law_colour, new_figure, thin
from sim.flight.trace import Trace, law_name
from sim.world.board import BoardGeometry


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
