"""How many samples agree with each of many planes."""

from __future__ import annotations

import math

import numpy as np

from ibvs_qp.vision.kernels.compile import kernel


@kernel("Tuple((f8[:, ::1], f8[::1]))(f8[:, ::1], f8[::1], i8, f8, i8[:, ::1], i8[::1], f8, f8, f8)")
def judge_planes(
    design: np.ndarray,
    inverse: np.ndarray,
    seed: int,
    value: float,
    pairs: np.ndarray,
    judged: np.ndarray,
    gate: float,
    width: float,
    span: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Planes through a seed and pairs of samples, and the weight of the samples that agree with each.

    Args:
        design: Columns x, y, 1 of the samples, normalised, (n, 3).
        inverse: 1/Z [1/m], (n,).
        seed: Place of the seed among the samples.
        value: 1/Z there [1/m].
        pairs: Places of the other two samples of every plane, (2, planes).
        judged: Places of the samples that are judged by, (m,).
        gate: Distance within which a sample agrees, share of 1/Z.
        width: Distance from the seed at which a sample's weight is 1/e, normalised.
        span: Least area that the arms of a plane span, normalised; narrower ones are level.

    Returns:
        (a, b, c) of the planes, (planes, 3), and the weights of the samples that agree, (planes,).
    """
    count = pairs.shape[1]
    a, b, c, scores = np.empty(count), np.empty(count), np.empty(count), np.zeros(count)
    x0, y0 = design[seed, 0], design[seed, 1]
    for k in range(count):
        one, two = pairs[0, k], pairs[1, k]
        x1, y1, x2, y2 = design[one, 0] - x0, design[one, 1] - y0, design[two, 0] - x0, design[two, 1] - y0
        rise1, rise2, cross = inverse[one] - value, inverse[two] - value, x1 * y2 - y1 * x2
        safe = cross if abs(cross) > span else np.inf
        a[k], b[k] = (rise1 * y2 - rise2 * y1) / safe, (rise2 * x1 - rise1 * x2) / safe
        c[k] = value - a[k] * x0 - b[k] * y0
    for place in judged:
        u, v, d = design[place, 0], design[place, 1], inverse[place]
        x, y, near = u - x0, v - y0, gate * d
        weight = math.exp(-(x * x + y * y) / (width * width))
        for k in range(count):
            scores[k] += weight if abs(a[k] * u + b[k] * v + c[k] - d) < near else 0.0
    planes = np.empty((count, 3))
    for k in range(count):
        planes[k, 0], planes[k, 1], planes[k, 2] = a[k], b[k], c[k]
    return planes, scores
