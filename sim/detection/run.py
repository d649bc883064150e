"""Frames through a method: in order within a motion sequence, alone otherwise; of files or of a bag."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ibvs_qp.measurement import RgbdFrame
from ibvs_qp.vision.picture.camera import Lens, RgbdCamera
from ibvs_qp.vision.picture.picture import denormalise, normalise
from ibvs_qp.vision.picture.settings import RgbdCameraSettings
from sim.detection.detection import Detection
from sim.detection.manifest import FrameEntry, motion_sequences
from sim.detection.methods import make_method
from sim.detection.pictures import PictureError, read_frame

if TYPE_CHECKING:
    from ibvs_qp.interfaces.ros.bag import Bag


#: Farthest a point may lie from the corner, in widths of the picture: far outside a lens model is undefined.
_FARTHEST = 2.0


def ideal_pixel(
    pixel: tuple[float, float] | None, lens: Lens, intrinsics: tuple[float, float, float, float]
) -> tuple[float, float] | None:
    """Place of a pixel of the picture as taken in the rectified one [px]; None where the lens model has none."""
    if pixel is None or lens.none:
        return pixel
    u, v = denormalise(lens.ideal(np.array([pixel]), intrinsics), intrinsics)[0].tolist()
    return (u, v) if np.isfinite((u, v)).all() else None


def raw_pixels(detection: Any, lens: Lens, frame: RgbdFrame) -> Any:
    """The detection with the end points of its lines in the picture as taken; (rho, theta) stay as they are."""
    if lens.none:
        return detection
    farthest = _FARTHEST * max(frame.rgb.shape[:2])

    def bent(line: Any) -> Any:
        if line is None:
            return None
        pixels = lens.pixels(normalise(line.pixels, frame.intrinsics), frame.intrinsics)
        return dataclasses.replace(line, pixels=np.clip(np.nan_to_num(pixels), -farthest, farthest))

    guides = {side: bent(line) for side, line in detection.guides.items()}
    return dataclasses.replace(detection, guides=guides, candidates=tuple(map(bent, detection.candidates)))


#: Frame interval of a sequence of unknown rate [ns]: 30 Hz.
_INTERVAL_NS = 33_333_333


@dataclasses.dataclass(frozen=True, kw_only=True)
class FrameResult:
    """A frame and its detection."""

    entry: FrameEntry  # the entry of the manifest
    frame: RgbdFrame | None  # the pictures as taken, or None if they are unreadable, or from a bag
    detection: Any  # result of the method, with the candidates to report
    time_ms: float  # wall-clock time of the method, without reading and without the list of all lines [ms]


def detect_frames(
    entries: list[FrameEntry],
    method_name: str,
    *,
    every: bool,
    track: bool,
    started: Callable[[FrameEntry], None] | None = None,
) -> list[FrameResult]:
    """Results of frames, in their order.

    Args:
        entries: The frames.
        method_name: One of `sim.detection.methods.METHODS`.
        every: Whether the candidates are all lines of the whole picture.
        track: Whether lines are tracked through a motion sequence; otherwise every frame stands alone.
        started: Called with every frame before it is read.
    """
    results: dict[int, FrameResult] = {}
    cameras: dict[RgbdCameraSettings, RgbdCamera] = {}
    for group in motion_sequences(entries):
        method = make_method(method_name)
        follows = track and len(group) > 1 and hasattr(method, "follow")
        for place, index in enumerate(group):
            if started is not None:
                started(entries[index])
            camera = cameras.setdefault(entries[index].camera, RgbdCamera(_in_metres(entries[index].camera)))
            stamp_ns = place * _INTERVAL_NS
            results[index] = _detect(entries[index], camera, method, every=every, follows=follows, stamp_ns=stamp_ns)
    return [results[index] for index in range(len(entries))]


def detect_bag(
    bag: Bag,
    method_name: str,
    *,
    every: bool,
    track: bool,
    seed: tuple[float, float] | None = None,
    settings: RgbdCameraSettings | None = None,
    finished: Callable[[FrameResult], None] | None = None,
) -> list[FrameResult]:
    """Results of the pictures of a bag, one motion sequence; the pictures themselves are not kept.

    Args:
        bag: The bag; a picture is named BAG/NUMBER_STAMP.
        method_name: As of `detect_frames`, and so the following.
        every: Whether the candidates are all lines.
        track: Whether lines are tracked.
        seed: Pixel on the surface in every picture, or None.
        settings: Of the camera; None for the lens of the bag's camera info.
        finished: Called with every result, which then has its picture.
    """
    results, method, camera = list[FrameResult](), make_method(method_name), None
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
        assert bag.held.camera is not None  # it makes a picture complete
        if camera is None:
            known = settings or RgbdCameraSettings(distortion=bag.held.camera.distortion)
            camera = RgbdCamera(_in_metres(known))
        result = _found(entry, frame, camera, method, every=every, follows=follows)
        if finished is not None:
            finished(result)
        results.append(dataclasses.replace(result, frame=None))
    return results


def _in_metres(settings: RgbdCameraSettings) -> RgbdCameraSettings:
    """The settings of pictures whose depth was read in metres already."""
    return dataclasses.replace(settings, depth_units_per_metre=1.0, color_bits=16)


def _detect(
    entry: FrameEntry, camera: RgbdCamera, method: Any, *, every: bool, follows: bool, stamp_ns: int
) -> FrameResult:
    color, depth = entry.folder / entry.color, entry.folder / entry.depth if entry.depth else None
    try:
        frame = read_frame(color, depth, entry.intrinsics, entry.depth_units_per_metre, stamp_ns, entry.camera)
    except PictureError as error:
        if follows:
            method.reset()
        return FrameResult(entry=entry, frame=None, detection=Detection(refused=str(error)), time_ms=0.0)
    return _found(entry, frame, camera, method, every=every, follows=follows)


def _found(
    entry: FrameEntry, frame: RgbdFrame, camera: RgbdCamera, method: Any, *, every: bool, follows: bool
) -> FrameResult:
    picture, seed = camera.picture(frame), ideal_pixel(entry.seed, camera.lens, entry.intrinsics)
    began = time.perf_counter()
    detection = (method.follow if follows else method.detect)(picture, seed)
    elapsed = 1e3 * (time.perf_counter() - began)
    if (every or detection.refused is not None) and hasattr(method, "every_line"):
        own = detection.candidates
        first = max((line.line_id for line in own), default=0) + 1
        more = (dataclasses.replace(line, line_id=k) for k, line in enumerate(method.every_line(picture), first))
        detection = dataclasses.replace(detection, candidates=(*own, *more))
    detection = raw_pixels(detection, camera.lens, frame)
    return FrameResult(entry=entry, frame=frame, detection=detection, time_ms=elapsed)
