"""The painted board and the outline of the intended band."""

from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

from sim.evaluate.paint_plan import band_mask, nominal_plan
from sim.evaluate.part import Part
from sim.evaluate.window import board_tip
from sim.figures.style import REFERENCE, law_panels, thin
from sim.flight.trace import Trace, law_name

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
