"""Checks of a picture: refusal with its reason, tolerant reading of vectors, times of the stages."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from ibvs_qp.measurement import RgbdFrame
from ibvs_qp.validation.numbers import described, vector

#: Smallest and largest side of a picture that can be used [px].
_SMALLEST, _LARGEST = 64, 4096
#: Largest picture in flight [px]: the widest of common RGB-D cameras. It takes 8 ms, one of 4096 x 4096 px 70 ms.
MOST_PIXELS = 1920 * 1200
#: A change of size or intrinsics costs 15 ms of masks and tables: only one that lasts so many pictures is
#: followed, 0.17 s at 30 Hz, before an image is stale.
STEADY_PICTURES = 5
#: Smallest focal length, and largest entry of the intrinsics [px].
_SHORTEST_FOCAL, _INTRINSICS_BOUND = 1.0, 1e5
#: No RGB-D camera measures a surface as far as this [m]: a larger median is in millimetres.
_FARTHEST = 100.0
#: Distance of the pixels of that median [px].
_SPARSE = 16


def frame_problem(frame: RgbdFrame) -> str | None:
    """Why a picture cannot be used at all, or None if it can."""
    rgb, depth = frame.rgb, frame.depth
    for name, part in (("colour", rgb), ("depth", depth)):
        if type(part) is not np.ndarray:
            return f"{name} picture is a {described(part)}, a plain array is needed"
    if rgb.ndim != 3 or rgb.shape[2] != 3:
        return f"colour picture of shape {rgb.shape}, (H, W, 3) is needed"
    if rgb.dtype != np.uint8:
        return f"colour picture of type {rgb.dtype}, uint8 is needed"
    if depth.shape != rgb.shape[:2]:
        return f"depth picture of shape {depth.shape}, {rgb.shape[:2]} is needed"
    if not np.issubdtype(depth.dtype, np.floating):
        return f"depth picture of type {depth.dtype}, metres in floating point are needed"
    for limit, beyond in ((min(rgb.shape[:2]) < _SMALLEST, "small"), (max(rgb.shape[:2]) > _LARGEST, "large")):
        if limit:
            return f"picture of {rgb.shape[1]} x {rgb.shape[0]} px is too {beyond}"
    entries = vector(frame.intrinsics, 4)
    if entries is None or not all(abs(entry) <= _INTRINSICS_BOUND for entry in entries):
        return f"intrinsics are not (fx, fy, cx, cy) in pixels but a {described(frame.intrinsics)}"
    if min(entries[:2]) <= _SHORTEST_FOCAL:
        return f"intrinsics {tuple(entries)} are not (fx, fy, cx, cy) in pixels"
    return _unit_problem(depth)


class PictureGate:
    """Checks the pictures of one flight; only a lasting change of size or intrinsics is followed.

    Args:
        in_flight: Whether a picture may have `MOST_PIXELS` only.
    """

    def __init__(self, in_flight: bool = True) -> None:
        self._in_flight = in_flight
        self.reset()

    def reset(self) -> None:
        """As before the first picture."""
        self._camera: tuple[float, ...] | None = None  # height, width and intrinsics in use
        self._other: tuple[float, ...] | None = None  # those of the last picture, if others
        self._seen = 0

    def problem(self, frame: RgbdFrame) -> str | None:
        """Why a picture cannot be used, or None if it can."""
        if problem := frame_problem(frame):
            return problem
        height, width = frame.depth.shape
        if self._in_flight and height * width > MOST_PIXELS:
            return f"picture of {width} x {height} px is too large: in flight at most {MOST_PIXELS} px"
        camera = (height, width, *frame.intrinsics)
        if self._camera in (None, camera):
            self._camera, self._other = camera, None
            return None
        self._seen = self._seen + 1 if self._other == camera else 1
        self._other = camera
        if self._seen < STEADY_PICTURES:
            other = "size" if self._camera[:2] != camera[:2] else "intrinsics"
            return f"another {other} than the pictures before, {self._seen} of {STEADY_PICTURES} until it is followed"
        self._camera, self._other = camera, None
        return None


def _unit_problem(depth: np.ndarray) -> str | None:
    """Why a depth picture is not in metres, or None if it may be."""
    sparse = depth[::_SPARSE, ::_SPARSE]
    known = sparse[(sparse > 0.0) & (sparse < np.inf)]  # false for NaN too
    median = float(np.median(known)) if known.size else 0.0
    if median <= _FARTHEST:
        return None
    return f"depth picture with a median of {median:.4g}: metres are needed, these look like millimetres"


#: Clock of the stages [s]: wall-clock time. A bench puts the CPU time of the thread here.
stage_time: Callable[[], float] = time.perf_counter


class StageClock:
    """Times of the stages [ms]; never enter a result.

    Attributes:
        times: Time per stage [ms].
    """

    def __init__(self) -> None:
        self.times: dict[str, float] = {}
        self._last = stage_time()

    def lap(self, stage: str) -> None:
        """End a stage."""
        now = stage_time()
        self.times[stage], self._last = 1e3 * (now - self._last), now


def finite_vector(values: np.ndarray | None, size: int) -> np.ndarray | None:
    """The values as floats, or None if they are absent or cannot be used."""
    if values is None:
        return None
    vector = np.asarray(values, float).ravel()
    return vector if vector.shape == (size,) and bool(np.isfinite(vector).all()) else None
