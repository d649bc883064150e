"""What guards a picture: refusal with its reason, tolerant reading of vectors, times of the stages."""

from __future__ import annotations

import math
import time
from collections.abc import Callable

import numpy as np

from ibvs_qp.measurement import RgbdFrame

#: Smallest picture that can be used [px].
_SMALLEST = 64


def frame_problem(frame: RgbdFrame) -> str | None:
    """Why a picture cannot be used at all, or None if it can."""
    rgb, depth = frame.rgb, frame.depth
    if not isinstance(rgb, np.ndarray) or rgb.ndim != 3 or rgb.shape[2] != 3:
        return f"colour picture of shape {getattr(rgb, 'shape', None)}, (H, W, 3) is needed"
    if rgb.dtype != np.uint8:
        return f"colour picture of type {rgb.dtype}, uint8 is needed"
    if not isinstance(depth, np.ndarray) or depth.shape != rgb.shape[:2]:
        return f"depth picture of shape {getattr(depth, 'shape', None)}, {rgb.shape[:2]} is needed"
    if not np.issubdtype(depth.dtype, np.floating):
        return f"depth picture of type {depth.dtype}, metres in floating point are needed"
    if min(rgb.shape[:2]) < _SMALLEST:
        return f"picture of {rgb.shape[1]} x {rgb.shape[0]} px is too small"
    try:
        fx, fy, cx, cy = (float(number) for number in frame.intrinsics)
    except (TypeError, ValueError):
        fx = fy = cx = cy = math.nan
    if not (math.isfinite(fx + fy + cx + cy) and min(fx, fy) > 1.0):
        return f"intrinsics {frame.intrinsics} are not (fx, fy, cx, cy) in pixels"
    return None


#: Tells the time of the stages [s]: by the wall. A bench puts the thread's own time here, undisturbed by neighbours.
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
