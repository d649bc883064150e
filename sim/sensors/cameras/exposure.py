"""Exposure of a real picture: blur during it, steps of its automatic control, and lost pictures."""

from __future__ import annotations

import math

import numpy as np

from sim.sensors.vibration import BLADE_HZ

#: Standard deviation of a uniform distribution of width 1.
_UNIFORM = 1.0 / math.sqrt(12.0)
#: Least and largest time between two steps of the automatic exposure [s].
STEP_TIMES_S = (0.5, 1.5)
#: Points per pixel along the path from which a line kernel is summed.
_POINTS_PER_PX = 8
#: Longest path of a motion blur [px].
_LONGEST_PX = 60.0


def line_kernel(u_px: float, v_px: float) -> np.ndarray:
    """Blur kernel of a uniform motion by (u, v) [px] about the middle of the exposure, float32, sum 1."""
    length = math.hypot(u_px, v_px)
    scale = min(1.0, _LONGEST_PX / max(length, _LONGEST_PX))
    half = [math.ceil(0.5 * scale * abs(size)) for size in (v_px, u_px)]
    count = 2 * math.ceil(_POINTS_PER_PX * (1.0 + scale * length))
    path = (np.arange(count) + 0.5) / count - 0.5
    v, u = (
        np.maximum(1.0 - np.abs(path * scale * size - np.arange(-reach, reach + 1)[:, None]), 0.0)
        for size, reach in zip((v_px, u_px), half, strict=True)
    )
    return (v @ u.T / count).astype(np.float32)


def vibration_sigma_px(focal_px: float, rate_rad_s: float, exposure_s: float) -> float:
    """Blur by vibration, standard deviation per axis [px].

    The rate is constant in a short exposure; a long one contains at most the whole stroke of the vibration.

    Args:
        focal_px: Focal length.
        rate_rad_s: Angular rate of the vibration per axis, rms.
        exposure_s: Exposure time.
    """
    return focal_px * rate_rad_s * min(_UNIFORM * exposure_s, 1.0 / (2.0 * math.pi * BLADE_HZ))


class ExposureSteps:
    """Brightness of an automatic exposure that steps up or down about every second.

    Args:
        size: Largest step from the nominal brightness, relative.
        rng: Times and sizes of the steps.
    """

    def __init__(self, size: float, rng: np.random.Generator) -> None:
        self._size, self._rng = size, rng
        self._factor, self._next_ns = 1.0, 0

    def factor(self, stamp_ns: int) -> float:
        """Brightness over the nominal one; call with rising times."""
        while self._size and stamp_ns >= self._next_ns:
            self._factor = 1.0 + float(self._rng.uniform(-self._size, self._size))
            self._next_ns += round(1e9 * self._rng.uniform(*STEP_TIMES_S))
        return self._factor


class Dropouts:
    """Pictures lost on their way.

    Args:
        probability: Of one picture.
        rng: Which are lost.
    """

    def __init__(self, probability: float, rng: np.random.Generator) -> None:
        self._probability, self._rng = probability, rng

    def lost(self) -> bool:
        """Whether the next picture is lost."""
        return self._probability > 0.0 and float(self._rng.random()) < self._probability
