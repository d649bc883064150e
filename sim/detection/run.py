"""Frames through a method: one after the other within a motion sequence, afresh for every other."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable, Iterator
from typing import Any

from ibvs_qp.measurement import RgbdFrame
from ibvs_qp.vision.survey.detection import Detection
from ibvs_qp.vision.survey.distortion import undistorted_line
from sim.detection.manifest import FrameEntry, motion_sequences
from sim.detection.methods import make_method
from sim.detection.pictures import PictureError, read_frame

#: Time from one frame to the next of a sequence of unknown rate [ns]: 30 Hz.
_INTERVAL_NS = 33_333_333


@dataclasses.dataclass(frozen=True, kw_only=True)
class SeenFrame:
    """A frame with what was found in it.

    Attributes:
        entry: What was asked.
        frame: The pictures, or None if they could not be read.
        result: What the method found; candidates are those to report.
        time_ms: Wall-clock time of the method, without reading and without the list of all lines [ms].
    """

    entry: FrameEntry
    frame: RgbdFrame | None
    result: Any
    time_ms: float


def detect_frames(
    entries: list[FrameEntry],
    method_name: str,
    *,
    every: bool,
    track: bool,
    distortion: tuple[float, ...] | None = None,
    started: Callable[[FrameEntry], None] | None = None,
) -> list[SeenFrame]:
    """Look at frames and report them in the order given.

    Args:
        entries: The frames.
        method_name: One of `sim.detection.methods.METHODS`.
        every: Whether the candidates shall be every line of the whole picture.
        track: Whether a motion sequence is followed; otherwise every frame stands alone.
        distortion: (k1, k2, p1, p2, k3) of the lens, or None for none; lines are straightened by it.
        started: Told of every frame before it is read.
    """
    seen: dict[int, SeenFrame] = {}
    for group in motion_sequences(entries):
        method = make_method(method_name)
        follows = track and len(group) > 1 and hasattr(method, "follow")
        for place, index in enumerate(group):
            if started is not None:
                started(entries[index])
            looked = _look(entries[index], method, every=every, follows=follows, stamp_ns=place * _INTERVAL_NS)
            seen[index] = looked if distortion is None else _straightened(looked, distortion)
    return [seen[index] for index in range(len(entries))]


def _look(entry: FrameEntry, method: Any, *, every: bool, follows: bool, stamp_ns: int) -> SeenFrame:
    try:
        frame = read_frame(
            entry.folder / entry.color,
            entry.folder / entry.depth if entry.depth else None,
            entry.intrinsics,
            entry.depth_units_per_metre,
            stamp_ns,
        )
    except PictureError as error:
        if follows:
            method.reset()
        return SeenFrame(entry=entry, frame=None, result=Detection(refused=str(error)), time_ms=0.0)
    began = time.perf_counter()
    result = (method.follow if follows else method.detect)(frame, entry.seed)
    elapsed = 1e3 * (time.perf_counter() - began)
    if (every or result.refused is not None) and hasattr(method, "every_line"):
        result = with_every_line(result, method.every_line(frame))
    return SeenFrame(entry=entry, frame=frame, result=result, time_ms=elapsed)


def _straightened(seen: SeenFrame, coefficients: tuple[float, ...]) -> SeenFrame:
    """The frame with the lens's distortion taken out of (rho, theta) of every line."""

    def straight(line: Any) -> Any:
        return None if line is None else undistorted_line(line, seen.entry.intrinsics, coefficients)

    guides = {side: straight(line) for side, line in seen.result.guides.items()}
    candidates = tuple(straight(line) for line in seen.result.candidates)
    return dataclasses.replace(seen, result=dataclasses.replace(seen.result, guides=guides, candidates=candidates))


def with_every_line(result: Any, lines: tuple[Any, ...]) -> Any:
    """The result with all lines of the picture as candidates, the method's own ones first."""
    return dataclasses.replace(result, candidates=(*result.candidates, *_fresh(result.candidates, lines)))


def _fresh(known: tuple[Any, ...], lines: tuple[Any, ...]) -> Iterator[Any]:
    """Lines with identities that no known one has."""
    first = max((line.line_id for line in known), default=0) + 1
    for number, line in enumerate(lines, first):
        yield dataclasses.replace(line, line_id=number)
