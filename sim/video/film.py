"""Flights as a video, law beside law: H.264 in an MP4 file, which every browser plays."""

from __future__ import annotations

import importlib.util
from collections.abc import Iterable, Iterator
from fractions import Fraction
from pathlib import Path

import cv2
import numpy as np

from sim.flight.pictures import unpack_picture
from sim.flight.trace import Trace, law_name
from sim.video.outside import OutsideView, scene_points
from sim.video.rasterizer import OutsideCamera, available

INK, PAPER, GRID, REFERENCE = (40, 40, 40), (250, 250, 250), (215, 215, 215), (120, 120, 120)
_LAWS = {"qp": (11, 111, 158), "paper": (213, 94, 26)}

Colour = tuple[int, int, int]


def law_ink(law: str) -> Colour:
    """Colour of a law, that of the figures."""
    return _LAWS.get(law, INK)


def write(
    image: np.ndarray, words: str, place: tuple[int, int], size: float, colour: Colour = INK, weight: int = 1
) -> None:
    """Write words with their lower left corner at (column, row)."""
    cv2.putText(image, words, place, cv2.FONT_HERSHEY_SIMPLEX, size, colour, weight, cv2.LINE_AA)


def width_of(words: str, size: float, weight: int = 1) -> int:
    """Width of words [px]."""
    return cv2.getTextSize(words, cv2.FONT_HERSHEY_SIMPLEX, size, weight)[0][0]


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


#: Sizes of the picture from outside and of the title; width of the camera picture beside a strip [px].
OUTSIDE_SIZE, TITLE_HEIGHT, CAMERA_WIDTH = (640, 400), 36, 400
#: Height of a strip below a picture [px].
STRIP_HEIGHT = 150


class Panel:
    """Pictures of one flight, in the order of time.

    Args:
        trace: The flight.
        camera: Of the view from outside; None leaves that out.
        alone: Whether the flight is the only one, so that the parts stand side by side.
    """

    def __init__(self, trace: Trace, camera: OutsideCamera | None, alone: bool) -> None:
        self._trace, self._alone = trace, alone
        self._outside = None if camera is None else OutsideView(trace, camera)
        self._times = np.array([t for t, _, _ in trace.pictures])
        self._shown, self._picture = -1, np.zeros((0, 0, 3), np.uint8)
        self._camera_size, strip = self._layout()
        self._strip = PushStrip(trace, strip)

    def _layout(self) -> tuple[tuple[int, int] | None, tuple[int, int]]:
        """Sizes of camera picture and strip [px]; all heights and widths of the panel come out even."""
        width, height = OUTSIDE_SIZE
        if not self._trace.pictures:
            return None, (width, STRIP_HEIGHT)
        rows, columns = unpack_picture(self._trace.pictures[0][1]).shape[:2]
        camera_width = width if self._outside is None else CAMERA_WIDTH
        camera = camera_width, min(2 * round(0.5 * camera_width * rows / columns), 3 * camera_width // 4)
        if self._outside is None:
            return camera, (width, STRIP_HEIGHT)
        return camera, (camera_width, height - camera[1]) if self._alone else (width - camera_width, camera[1])

    def draw(self, t: float) -> np.ndarray:
        """The panel at a time not before that of the last call [s], uint8 RGB."""
        tick = min(int(np.searchsorted(self._trace.t, t)), len(self._trace.t) - 1)
        parts = [] if self._outside is None else [self._outside.draw(tick)]
        strip = self._strip.draw(tick)
        if self._camera_size is None:
            parts.append(strip)
        elif self._outside is None:
            parts += [self._camera(t, self._camera_size), strip]
        elif self._alone:
            parts = [np.hstack((*parts, np.vstack((self._camera(t, self._camera_size), strip))))]
        else:
            parts.append(np.hstack((self._camera(t, self._camera_size), strip)))
        body = np.vstack(parts)
        return np.vstack((self._title(tick, body.shape[1]), body))

    def _camera(self, t: float, size: tuple[int, int]) -> np.ndarray:
        """The latest camera picture; a tall one has paper beside it."""
        index = max(int(np.searchsorted(self._times, t + 1e-9, side="right")) - 1, 0)
        if index != self._shown:
            taken, (width, height) = unpack_picture(self._trace.pictures[index][1]), size
            shown = min(width, 2 * round(0.5 * height * taken.shape[1] / taken.shape[0]))
            side = (width - shown) // 2
            self._picture = np.full((height, width, 3), PAPER, np.uint8)
            self._picture[:, side : side + shown] = cv2.resize(taken, (shown, height), interpolation=cv2.INTER_AREA)
            self._shown = index
        return self._picture

    def _title(self, tick: int, width: int) -> np.ndarray:
        title = np.full((TITLE_HEIGHT, width, 3), PAPER, np.uint8)
        row = int(self._trace.row[tick])
        phase = self._trace.phases[int(self._trace.phase[tick])] + (f" (row {row})" if row else "")
        time = f"{self._trace.t[tick]:.1f} s"
        write(title, law_name(self._trace.law), (12, 25), 0.65, law_ink(self._trace.law), 2)
        write(title, phase, (220, 25), 0.6)
        write(title, time, (width - 12 - width_of(time, 0.6), 25), 0.6)
        return title


FRAME_RATE_HZ = 10
#: Constant quality of H.264: 23 is the encoder's default, lower is better.
_QUALITY = 25
#: Pictures between two that a player can jump to.
_KEY_EVERY = 5 * FRAME_RATE_HZ


def missing_encoder() -> str | None:
    """The message if no video can be written; None if one can."""
    if importlib.util.find_spec("av") is None:
        return "no video: it needs the package av, and nothing else does; pip install av"
    return None


def film_frames(traces: dict[str, Trace], rate_hz: float = FRAME_RATE_HZ) -> Iterator[np.ndarray]:
    """Pictures of all flights side by side; a law that ended earlier keeps its last one.

    Args:
        traces: Flights of at least one tick, left to right.
        rate_hz: Pictures per second of flight.

    Yields:
        uint8 RGB of even height and width.
    """
    cv2.setNumThreads(1)
    camera = None
    if available():
        camera = OutsideCamera.framing(np.concatenate([scene_points(trace) for trace in traces.values()]), OUTSIDE_SIZE)
    panels = [Panel(trace, camera, len(traces) == 1) for trace in traces.values()]
    end = max(float(trace.t[-1]) for trace in traces.values())
    for number in range(int(end * rate_hz) + 1):
        drawn = [panel.draw(number / rate_hz) for panel in panels]
        height = max(map(len, drawn))  # a law without a picture has a lower panel
        below = [np.full((height - len(panel), *panel.shape[1:]), PAPER, np.uint8) for panel in drawn]
        yield np.hstack([np.vstack(pair) for pair in zip(drawn, below, strict=True)])


def write_video(traces: dict[str, Trace], file: Path) -> None:
    """Write the flights at their own speed, see `film_frames`."""
    encode(film_frames(traces), file, FRAME_RATE_HZ)


def encode(frames: Iterable[np.ndarray], file: Path, rate_hz: int) -> None:
    """Encode pictures as H.264.

    Args:
        frames: uint8 RGB of one even height and width.
        file: MP4 file to write.
        rate_hz: Pictures per second.
    """
    import av

    with av.open(str(file), "w", format="mp4", options={"movflags": "+faststart"}) as container:
        stream = None
        for frame in frames:
            if stream is None:
                stream = container.add_stream("libx264", rate=Fraction(rate_hz))
                stream.height, stream.width = frame.shape[:2]
                stream.pix_fmt = "yuv420p"  # the only one that every browser decodes
                stream.codec_context.thread_count = 1
                stream.options = {"crf": str(_QUALITY), "preset": "veryfast", "g": str(_KEY_EVERY)}
            container.mux(stream.encode(av.VideoFrame.from_ndarray(frame, format="rgb24")))
        if stream is not None:
            container.mux(stream.encode(None))


def still(file: Path, fraction: float) -> np.ndarray:
    """The picture before a fraction of a video's length that a player can jump to, uint8 RGB (height, width, 3)."""
    import av

    with av.open(str(file)) as container:
        container.seek(round(fraction * (container.duration or 0)))
        return next(container.decode(video=0)).to_ndarray(format="rgb24")
