"""Frames through a method: in order within a motion sequence, alone otherwise; of files or of a bag."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ibvs_qp.measurement import RgbdFrame
from ibvs_qp.vision.survey.detection import Detection
from ibvs_qp.vision.survey.distortion import undistorted_line
from sim.detection.manifest import FrameEntry, motion_sequences
from sim.detection.methods import make_method
from sim.detection.pictures import PictureError, read_frame

if TYPE_CHECKING:
    from ibvs_qp.ros.bag import Bag

#: Frame interval of a sequence of unknown rate [ns]: 30 Hz.
_INTERVAL_NS = 33_333_333


@dataclasses.dataclass(frozen=True, kw_only=True)
class FrameResult:
    """A frame and its detection."""

    entry: FrameEntry  # the entry of the manifest
    frame: RgbdFrame | None  # the pictures, or None if they are unreadable, or from a bag
    detection: Any  # result of the method, with the candidates to report
    time_ms: float  # wall-clock time of the method, without reading and without the list of all lines [ms]


def detect_frames(
    entries: list[FrameEntry],
    method_name: str,
    *,
    every: bool,
    track: bool,
    distortion: tuple[float, ...] | None = None,
    started: Callable[[FrameEntry], None] | None = None,
) -> list[FrameResult]:
    """Results of frames, in their order.

    Args:
        entries: The frames.
        method_name: One of `sim.detection.methods.METHODS`.
        every: Whether the candidates are all lines of the whole picture.
        track: Whether lines are tracked through a motion sequence; otherwise every frame stands alone.
        distortion: (k1, k2, p1, p2, k3) of the lens to straighten the lines, or None for none.
        started: Called with every frame before it is read.
    """
    results: dict[int, FrameResult] = {}
    for group in motion_sequences(entries):
        method = make_method(method_name)
        follows = track and len(group) > 1 and hasattr(method, "follow")
        for place, index in enumerate(group):
            if started is not None:
                started(entries[index])
            result = _detect(entries[index], method, every=every, follows=follows, stamp_ns=place * _INTERVAL_NS)
            results[index] = result if distortion is None else _straightened(result, distortion)
    return [results[index] for index in range(len(entries))]


def detect_bag(
    bag: Bag,
    method_name: str,
    *,
    every: bool,
    track: bool,
    seed: tuple[float, float] | None = None,
    distortion: tuple[float, ...] | None = None,
    finished: Callable[[FrameResult], None] | None = None,
) -> list[FrameResult]:
    """Results of the pictures of a bag, one motion sequence; the pictures themselves are not kept.

    Args:
        bag: The bag; a picture is named BAG/NUMBER_STAMP.
        method_name: As of `detect_frames`, and so the following.
        every: Whether the candidates are all lines.
        track: Whether lines are tracked.
        seed: Pixel on the surface in every picture, or None.
        distortion: Of the lens; None for that of the bag's camera info.
        finished: Called with every result, which then has its picture.
    """
    results, method = list[FrameResult](), make_method(method_name)
    follows = track and hasattr(method, "follow")
    for index, frame in enumerate(bag.pictures()):
        entry = FrameEntry(
            color=f"{bag.path.name}/{index:06d}_{frame.stamp_ns}",
            depth="",
            folder=Path(),
            intrinsics=frame.intrinsics,
            depth_units_per_metre=1.0,
            seed=seed,
        )
        result = _found(entry, frame, method, every=every, follows=follows)
        assert bag.held.camera is not None  # it makes a picture complete
        lens = bag.held.camera.distortion if distortion is None else distortion
        result = _straightened(result, lens) if any(lens) else result
        if finished is not None:
            finished(result)
        results.append(dataclasses.replace(result, frame=None))
    return results


def _detect(entry: FrameEntry, method: Any, *, every: bool, follows: bool, stamp_ns: int) -> FrameResult:
    color, depth = entry.folder / entry.color, entry.folder / entry.depth if entry.depth else None
    try:
        frame = read_frame(color, depth, entry.intrinsics, entry.depth_units_per_metre, stamp_ns)
    except PictureError as error:
        if follows:
            method.reset()
        return FrameResult(entry=entry, frame=None, detection=Detection(refused=str(error)), time_ms=0.0)
    return _found(entry, frame, method, every=every, follows=follows)


def _found(entry: FrameEntry, frame: RgbdFrame, method: Any, *, every: bool, follows: bool) -> FrameResult:
    began = time.perf_counter()
    detection = (method.follow if follows else method.detect)(frame, entry.seed)
    elapsed = 1e3 * (time.perf_counter() - began)
    if (every or detection.refused is not None) and hasattr(method, "every_line"):
        own = detection.candidates
        first = max((line.line_id for line in own), default=0) + 1
        more = (dataclasses.replace(line, line_id=k) for k, line in enumerate(method.every_line(frame), first))
        detection = dataclasses.replace(detection, candidates=(*own, *more))
    return FrameResult(entry=entry, frame=frame, detection=detection, time_ms=elapsed)


def _straightened(result: FrameResult, coefficients: tuple[float, ...]) -> FrameResult:
    """The result with (rho, theta) of every line corrected for the lens distortion."""

    def straight(line: Any) -> Any:
        return None if line is None else undistorted_line(line, result.entry.intrinsics, coefficients)

    guides = {side: straight(line) for side, line in result.detection.guides.items()}
    candidates = tuple(map(straight, result.detection.candidates))
    detection = dataclasses.replace(result.detection, guides=guides, candidates=candidates)
    return dataclasses.replace(result, detection=detection)
