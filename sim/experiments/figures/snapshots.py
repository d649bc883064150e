"""Pictures of a flight rendered again from its log: same camera poses, same perception."""

from __future__ import annotations

import cv2
import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.interfaces.overlay import draw_overlay
from ibvs_qp.measurement import RgbdFrame
from ibvs_qp.vision.config import VisionConfig
from ibvs_qp.vision.perception import Perception
from sim.evaluate.path_error import CONTACT_N
from sim.evaluate.window import phase_window
from sim.figures.style import new_figure
from sim.flight.trace import Trace
from sim.sensors.cameras import PlaneCamera
from sim.world.board import BoardGeometry
from sim.world.canvas import Canvas

#: Moments of row 1 that are shown, as fractions of it.
MOMENTS = (0.05, 0.5, 0.92)
#: Pictures processed before each moment, so that tracks exist; and their spacing in ticks.
LEAD_FRAMES, FRAME_TICKS = 12, 8
#: Cells over which a normal is taken, and width of the box's line [px].
CELL_PX, BOX_PX = 15, 3
#: Lean of the normals in the legend, as the sine of the angle.
LEAN = 0.6
#: Distance from the fitted plane, relative, within which a pixel belongs to it.
PLANE_GATE = 0.03


def _canvas(trace: Trace, until: int) -> Canvas:
    """The board as painted until a tick."""
    canvas, geometry = Canvas(trace.scene, trace.seed), BoardGeometry(trace.scene)
    brush = None
    for tick in range(0, until, 3):
        if trace.push_true[tick] > CONTACT_N:
            point = geometry.board_coordinates(trace.tip[tick, 1:])
            canvas.stroke(brush, point)
            brush = point
        else:
            brush = None
    return canvas


def painted_board(trace: Trace) -> np.ndarray:
    """The board at the end of the flight, painted again from the log, uint8 RGB (h, w, 3)."""
    return _canvas(trace, len(trace.t)).rgb


def draw_snapshots(trace: Trace) -> Figure:
    """Three moments: picture with detected lines above, normals with the plane's bounding box below."""
    begin, end = phase_window(trace, "paint")
    row = np.flatnonzero((trace.t >= begin) & (trace.t <= end) & (trace.row <= 1))
    figure = new_figure(4.6)
    grid = figure.subplots(2, len(MOMENTS))
    for (above, below), moment in zip(grid.T, MOMENTS, strict=True):
        tick = int(row[int(moment * (len(row) - 1))])
        camera = PlaneCamera(trace.scene, VehicleParams(), _canvas(trace, tick), trace.seed)
        ticks = range(tick - LEAD_FRAMES * FRAME_TICKS, tick + 1, FRAME_TICKS)
        frames = [camera.capture(trace.position[at], trace.attitude[at], round(trace.t[at] * 1e9)) for at in ticks]
        perception = Perception(VisionConfig(paint_color=trace.scene.paint.color), VehicleParams())
        frame, perceived = [
            (frame, perception.process(frame, attitude=trace.attitude[at], rotation=np.zeros(3), velocity=None))
            for at, frame in zip(ticks, frames, strict=True)
        ][-1]
        above.imshow(draw_overlay(frame.rgb, perceived, words=False))
        below.imshow(normal_picture(frame, perceived.features.plane if perceived.features else None))
        above.set_title(f"t = {trace.t[tick]:.1f} s, row {int(trace.row[tick])}")
        for axes in (above, below):
            axes.set_axis_off()
    keys = [
        Line2D([], [], color="#ffa000", linewidth=2, label="edge of the board (tick: side of the surface)"),
        Line2D([], [], color="#ff00c8", linewidth=2, label="edge of the paint"),
        Patch(facecolor="#bfe9c8", label="working surface found"),
        Patch(facecolor="#7f4a4a", label="masked tool"),
        Patch(facecolor=_normal_colour(0.0, 0.0), label="normal to the camera"),
        Patch(facecolor=_normal_colour(LEAN, 0.0), label="normal leaning right"),
        Patch(facecolor=_normal_colour(0.0, LEAN), label="normal leaning up"),
        Patch(facecolor="white", edgecolor="#555555", label="bounding box, made for this figure"),
    ]
    figure.legend(handles=keys, loc="outside lower center", ncols=3, fontsize=7.5)
    return figure


def _normal_colour(right: float, up: float) -> tuple[float, float, float]:
    """Colour of a normal in `normal_picture`, 0..1."""
    return 0.5 * (1.0 + right), 0.5 * (1.0 + up), 0.5 * (1.0 + (1.0 - right**2 - up**2) ** 0.5)


def normal_picture(frame: RgbdFrame, plane: tuple[float, float, float, float] | None) -> np.ndarray:
    """Surface normals as colours (right red, up green, to the camera blue), with the box around the working surface.

    Args:
        frame: Colour and depth.
        plane: (A, B, C, D) of the surface in C that perception found, D = -1, or None for no box.

    Returns:
        uint8 (H, W, 3).
    """
    fx, fy, cx, cy = frame.intrinsics
    height, width = frame.depth.shape
    good = frame.depth > 0.0
    x, y = np.meshgrid((np.arange(width) - cx) / fx, (np.arange(height) - cy) / fy)
    inverse = np.where(good, 1.0 / np.maximum(frame.depth, 1e-3), 0.0)
    density = np.maximum(cv2.blur(good.astype(float), (CELL_PX, CELL_PX)), 1e-6)
    smooth = cv2.blur(inverse, (CELL_PX, CELL_PX)) / density  # holes have no weight
    a, b = np.gradient(smooth, axis=1) * fx, np.gradient(smooth, axis=0) * fy
    normal = np.stack((-a, b, smooth - a * x - b * y), axis=2)
    normal /= np.maximum(np.linalg.norm(normal, axis=2, keepdims=True), 1e-9)
    picture = np.where(good[..., None], 127.5 * (normal + 1.0), 0.0).astype(np.uint8)
    if plane is None:
        return picture
    nominal = plane[0] * x + plane[1] * y + plane[2]
    on = good & (np.abs(inverse / np.maximum(nominal, 1e-6) - 1.0) < PLANE_GATE)
    kernel = np.ones((CELL_PX, CELL_PX), np.uint8)
    box = cv2.boundingRect(cv2.morphologyEx(on.astype(np.uint8), cv2.MORPH_OPEN, kernel))
    return cv2.rectangle(picture, box, (255, 255, 255), BOX_PX)
