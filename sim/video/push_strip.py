"""The push of a whole flight over time, with a cursor at the present."""

from __future__ import annotations

import cv2
import numpy as np

from sim.flight.trace import Trace
from sim.video.drawing import GRID, INK, PAPER, REFERENCE, Colour, law_ink, write

#: Push at the top of the strip, per greatest commanded push [-].
HEADROOM = 1.7
#: Room for labels on the left, and free room on the other sides [px].
_LEFT, _RIGHT, _TOP, _BOTTOM = 46, 10, 24, 16


class PushStrip:
    """Draws the push of one flight.

    Args:
        trace: The flight.
        size: (width, height) [px].
    """

    def __init__(self, trace: Trace, size: tuple[int, int]) -> None:
        self._trace, self._size = trace, size
        commanded = float(np.max(trace.push_reference, initial=0.0))
        self._top_n = HEADROOM * max(commanded, 1.0)
        self._end_s = max(float(trace.t[-1]), 1e-3)
        self._plot = np.full((size[1], size[0], 3), PAPER, np.uint8)
        for value in (0.0, commanded):
            row = int(self._row(value))
            cv2.line(self._plot, (_LEFT, row), (size[0] - _RIGHT, row), GRID, 1)
            write(self._plot, f"{value:g} N", (6, row + 4), 0.38, REFERENCE)
        write(self._plot, "push on the board", (6, 15), 0.42)
        self._curve(trace.push_reference, REFERENCE)
        self._curve(trace.push_true, law_ink(trace.law))

    def draw(self, tick: int) -> np.ndarray:
        """The strip at a tick, uint8 RGB (height, width, 3)."""
        strip, push = self._plot.copy(), float(self._trace.push_true[tick])
        place = int(self._column(self._trace.t[tick])), int(self._row(push))
        cv2.line(strip, (place[0], _TOP), (place[0], self._size[1] - _BOTTOM), INK, 1)
        cv2.circle(strip, place, 4, law_ink(self._trace.law), -1, cv2.LINE_AA)
        write(strip, f"{push:.1f} N", (min(place[0] + 6, self._size[0] - 58), _TOP + 6), 0.45)
        return strip

    def _curve(self, values: np.ndarray, colour: Colour) -> None:
        points = np.column_stack((self._column(self._trace.t), self._row(values)))
        cv2.polylines(self._plot, [points.astype(np.int32)], False, colour, 1, cv2.LINE_AA)

    def _column(self, t: np.ndarray | float) -> np.ndarray:
        return _LEFT + (self._size[0] - _RIGHT - _LEFT) * np.asarray(t) / self._end_s

    def _row(self, push_n: np.ndarray | float) -> np.ndarray:
        part = np.clip(np.asarray(push_n) / self._top_n, -0.05, 1.0)
        return np.rint(self._size[1] - _BOTTOM - (self._size[1] - _BOTTOM - _TOP) * part)
