"""Pictures of flights as a video: H.264 in an MP4 file, which every browser plays."""

from __future__ import annotations

import importlib.util
from collections.abc import Iterable, Iterator
from fractions import Fraction
from pathlib import Path

import cv2
import numpy as np

from sim.flight.trace import Trace
from sim.video.outside import scene_points
from sim.video.panel import OUTSIDE_SIZE, PAPER, Panel
from sim.video.rasterizer import OutsideCamera, available

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
