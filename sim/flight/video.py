"""The video: camera pictures of every law side by side, above the push force."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import cv2
import numpy as np

from sim.flight.trace import Trace, law_name

FRAME_RATE_HZ = 15.0
PANEL_WIDTH, STRIP_HEIGHT, TITLE_HEIGHT, MARGIN = 640, 150, 36, 46
#: Push shown at the top of the strip, per commanded push.
FORCE_HEADROOM = 1.7
JPEG_QUALITY = 88
# BGR colours of OpenCV.
_INK, _PAPER, _GRID, _REFERENCE = (40, 40, 40), (250, 250, 250), (215, 215, 215), (120, 120, 120)
_COLOURS = {"qp": (158, 111, 11), "paper": (26, 94, 213)}


def pack_picture(rgb: np.ndarray) -> np.ndarray:
    """JPEG bytes of an RGB picture, (K,) uint8: raw pictures of a flight would fill a gigabyte."""
    good, data = cv2.imencode(".jpg", rgb[..., ::-1], (cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY))
    if not good:
        raise ValueError(f"a picture of shape {rgb.shape} cannot be encoded")
    return data.ravel()


def unpack_picture(picture: np.ndarray) -> np.ndarray:
    """RGB picture, (H, W, 3), of a raw picture or of `pack_picture`'s bytes."""
    if picture.ndim == 3:
        return picture
    decoded = cv2.imdecode(picture, cv2.IMREAD_COLOR)
    if decoded is None:
        raise ValueError("a packed picture of the trace is damaged")
    return np.ascontiguousarray(decoded[..., ::-1])


def pack_pictures(trace: Trace) -> Trace:
    """The trace with every raw picture packed."""
    packed = [(t, pack_picture(p) if p.ndim == 3 else p, phase) for t, p, phase in trace.pictures]
    return dataclasses.replace(trace, pictures=packed)


def write_video(traces: dict[str, Trace], file: Path) -> None:
    """Write an mp4 at the flight's own speed; a law that ended earlier keeps its last picture.

    Args:
        traces: Flights with pictures, one panel each, left to right.
        file: Where to write.
    """
    cv2.setNumThreads(1)
    panels = {law: _Panel(trace) for law, trace in traces.items() if trace.pictures}
    end = max(float(panel.trace.t[-1]) for panel in panels.values())
    height = max(panel.height for panel in panels.values())
    size = (PANEL_WIDTH * len(panels), height)
    writer = cv2.VideoWriter(str(file), cv2.VideoWriter.fourcc(*"mp4v"), FRAME_RATE_HZ, size)
    try:
        for number in range(int(end * FRAME_RATE_HZ) + 1):
            t = number / FRAME_RATE_HZ
            writer.write(np.hstack([panel.draw(t, height) for panel in panels.values()]))
    finally:
        writer.release()


class _Panel:
    """One law's column: title with time and phase, picture, force strip."""

    def __init__(self, trace: Trace) -> None:
        self.trace = trace
        self.times = np.array([t for t, _, _ in trace.pictures])
        height, width = unpack_picture(trace.pictures[0][1]).shape[:2]
        self.picture_height = round(height * PANEL_WIDTH / width / 2) * 2
        self.height = TITLE_HEIGHT + self.picture_height + STRIP_HEIGHT
        self.visible, self.scaled = -1, np.zeros(0)
        self.top_n = FORCE_HEADROOM * max(float(np.max(trace.push_reference, initial=0.0)), 1.0)
        self.plot = self._force_plot()

    def draw(self, t: float, height: int) -> np.ndarray:
        index = max(int(np.searchsorted(self.times, t + 1e-9, side="right")) - 1, 0)
        if index != self.visible:
            picture = unpack_picture(self.trace.pictures[index][1])[..., ::-1]
            self.scaled = cv2.resize(picture, (PANEL_WIDTH, self.picture_height), interpolation=cv2.INTER_AREA)
            self.visible = index
        panel = np.full((height, PANEL_WIDTH, 3), _PAPER, np.uint8)
        panel[TITLE_HEIGHT : TITLE_HEIGHT + self.picture_height] = self.scaled
        tick = min(int(np.searchsorted(self.trace.t, t)), len(self.trace.t) - 1)
        self._title(panel, float(self.trace.t[tick]), tick)
        strip = panel[TITLE_HEIGHT + self.picture_height :][:STRIP_HEIGHT]
        strip[:] = self.plot
        self._cursor(strip, tick)
        return panel

    def _title(self, panel: np.ndarray, t: float, tick: int) -> None:
        row = int(self.trace.row[tick])
        phase = self.trace.phases[int(self.trace.phase[tick])] + (f" (row {row})" if row else "")
        _text(panel, law_name(self.trace.law), (12, 25), 0.65, _COLOURS.get(self.trace.law, _INK), 2)
        _text(panel, phase, (220, 25), 0.6, _INK)
        _text(panel, f"{t:6.1f} s", (PANEL_WIDTH - 110, 25), 0.6, _INK)

    def _force_plot(self) -> np.ndarray:
        """The whole flight's push, drawn once; a cursor marks the present tick."""
        plot = np.full((STRIP_HEIGHT, PANEL_WIDTH, 3), _PAPER, np.uint8)
        reference = float(np.max(self.trace.push_reference, initial=0.0))
        for value in (0.0, reference):
            y = self._y(value)
            cv2.line(plot, (MARGIN, y), (PANEL_WIDTH - 10, y), _GRID, 1)
            _text(plot, f"{value:g} N", (6, y + 4), 0.38, _REFERENCE)
        self._curve(plot, self.trace.push_reference, _REFERENCE)
        self._curve(plot, self.trace.push_true, _COLOURS.get(self.trace.law, _INK))
        _text(plot, "push", (6, 16), 0.42, _INK)
        return plot

    def _curve(self, plot: np.ndarray, values: np.ndarray, colour: tuple[int, int, int]) -> None:
        points = np.column_stack((self._x(self.trace.t), [self._y(value) for value in values]))
        cv2.polylines(plot, [points.astype(np.int32)], False, colour, 1, cv2.LINE_AA)

    def _cursor(self, strip: np.ndarray, tick: int) -> None:
        x = int(self._x(self.trace.t[tick]))
        push = float(self.trace.push_true[tick])
        cv2.line(strip, (x, 6), (x, STRIP_HEIGHT - 8), _INK, 1)
        cv2.circle(strip, (x, self._y(push)), 4, _COLOURS.get(self.trace.law, _INK), -1, cv2.LINE_AA)
        _text(strip, f"{push:.1f} N", (min(x + 8, PANEL_WIDTH - 60), 20), 0.5, _INK)

    def _x(self, t: np.ndarray | float) -> np.ndarray:
        span = max(float(self.trace.t[-1]), 1e-3)
        return np.asarray(MARGIN + (PANEL_WIDTH - 10 - MARGIN) * np.asarray(t) / span)

    def _y(self, push_n: float) -> int:
        fraction = min(max(push_n / self.top_n, -0.05), 1.0)
        return round(STRIP_HEIGHT - 18 - (STRIP_HEIGHT - 30) * fraction)


def _text(
    image: np.ndarray, words: str, place: tuple[int, int], size: float, colour: tuple[int, int, int], weight: int = 1
) -> None:
    cv2.putText(image, words, place, cv2.FONT_HERSHEY_SIMPLEX, size, colour, weight, cv2.LINE_AA)
