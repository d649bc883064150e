"""Strongest answers of profiles, and their places below a pixel."""

from __future__ import annotations

import math

import numpy as np

from ibvs_qp.vision.kernels.compile import inner

#: A neighbour's gradient counts at least this share of the peak, so that the logarithm stays tame.
_FLOOR = np.float32(0.05)
#: The peak lies at most this far from the strongest whole place [px].
_FARTHEST = np.float32(0.7)
#: Least peak, and the curvature that is no peak at all.
_TINY, _FLAT = np.float32(1e-6), np.float32(-2e-6)
#: Width of the preference for the predicted place, share of the strip.
_PREFERENCE = 0.6


@inner
def preferences(reach: int) -> np.ndarray:
    """Weight of every place of a strip: the predicted one in the middle counts most, float32 (2 reach + 1,)."""
    weights = np.empty(2 * reach + 1, np.float32)
    for i in range(2 * reach + 1):
        offset = (i - reach) / max(_PREFERENCE * reach, 1.0)
        weights[i] = math.exp(-0.5 * (offset * offset))
    return weights


@inner
def strongest(answers: np.ndarray, k: int, preference: np.ndarray) -> int:
    """Index of the strongest answer of profile k among answers (K, n), with a preference for some places."""
    best, most = 0, answers[k, 0] * preference[0]
    for i in range(1, len(preference)):
        value = answers[k, i] * preference[i]
        if value > most:
            best, most = i, value
    return best


@inner
def largest(answers: np.ndarray, k: int) -> float:
    """Largest answer of profile k among answers (K, n)."""
    most = answers[k, 0]
    for i in range(1, answers.shape[1]):
        most = max(most, answers[k, i])
    return most


@inner
def peak_near(answers: np.ndarray, k: int, index: int) -> tuple[float, np.floating, bool]:
    """Peak of the answers (K, n) of profile k near a whole place.

    The interpolation is that of a Gaussian peak: a blurred step has a Gaussian derivative, on which a parabola would be
    off by up to 0.03 px.

    Returns:
        Its place from the middle of the strip [px], the answer at the nearest whole place, and whether a peak could be
        there: not at the border of the strip.
    """
    middle = min(max(index, 1), answers.shape[1] - 2)
    peak = answers[k, middle]
    scale = max(peak, _TINY)
    before = math.log(max(answers[k, middle - 1] / scale, _FLOOR))
    behind = math.log(max(answers[k, middle + 1] / scale, _FLOOR))
    curvature = min(before + behind, -_TINY)
    shift = (before - behind) * np.float32(0.5) / curvature
    shift = min(max(shift, -_FARTHEST), _FARTHEST)
    if not curvature < _FLAT:  # nothing to interpolate
        shift = np.float32(0.0)
    return np.float64(middle - answers.shape[1] // 2) + np.float64(shift), peak, index == middle
