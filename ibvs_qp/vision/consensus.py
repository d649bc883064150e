"""What most points of a line agree with, before any is fitted; many lines at once."""

from __future__ import annotations

import numpy as np

#: Shortest distance of the points of a pair [px].
_APART = 4.0
#: Share of the points that must agree with a prediction moved across its line, else lines are tried.
_AGREEING = 0.8


def shifted_lines(distance: np.ndarray, used: np.ndarray, gate: float) -> tuple[np.ndarray, np.ndarray]:
    """Distances of the points from the predicted line moved to the middle of them, and whether most agree with it.

    Args:
        distance: From the prediction [px], (L, K).
        used: Points that count, bool (L, K).
        gate: Distance within which a point agrees [px].

    Returns:
        Distances (L, K), not finite without any point, and agreement (L,).
    """
    count = np.count_nonzero(used, axis=1)
    middle = middle_values(distance, used, count)
    moved = distance - middle[:, None]
    near = used & (np.abs(moved) < gate)
    return moved, np.count_nonzero(near, axis=1) >= np.maximum(_AGREEING * count, 1.0)


def consensus_lines(
    u: np.ndarray, v: np.ndarray, used: np.ndarray, gate: float, starts: int
) -> tuple[np.ndarray, np.ndarray]:
    """Distances of the points from the line that most of them agree with, and whether any pair spans a line.

    The lines tried run through fixed pairs, a half and a third of the points apart.

    Args:
        u: Positions along the lines [px], growing, (L, K).
        v: Positions across them [px], (L, K).
        used: Points that count, bool (L, K).
        gate: Distance within which a point agrees [px].
        starts: Places from which pairs are tried.

    Returns:
        Distances (L, K) and validity (L,).
    """
    count = used.sum(axis=1)
    held = np.flatnonzero(used)
    if len(held) == 0:
        return np.full(u.shape, np.inf), np.zeros(len(u), bool)
    counts = np.maximum(count, 1)[:, None]
    one = (np.linspace(0.0, 1.0, starts) * (counts - 1)).astype(np.intp)
    two = np.concatenate(((one + counts // 2) % counts, (one + counts // 3) % counts), axis=1)
    before = np.minimum(np.cumsum(count) - count, len(held) - 1)[:, None]  # a line without points borrows some
    last = len(held) - 1
    one = held.take(np.minimum(np.concatenate((one, one), axis=1) + before, last))
    two = held.take(np.minimum(two + before, last))
    u, v = u.astype(np.float32), v.astype(np.float32)
    u_one, v_one = u.take(one), v.take(one)
    run = u.take(two) - u_one
    apart = np.abs(run) > _APART
    slope = (v.take(two) - v_one) / np.where(apart, run, np.float32(np.inf))
    level = v_one - slope * u_one
    lines = np.stack((level, slope), axis=2)
    points = np.stack((np.ones_like(u), u), axis=1)
    distance = lines @ points
    distance -= v[:, None]
    closeness = distance * distance
    closeness *= np.float32(-1.0 / gate**2)
    closeness += np.float32(1.0)
    np.maximum(closeness, np.float32(0.0), out=closeness)
    score = (closeness @ used.astype(np.float32)[:, :, None])[:, :, 0]
    best = np.where(apart, score, np.float32(-1.0)).argmax(axis=1)
    return distance[np.arange(len(u)), best], apart.any(axis=1) & (count > 0)


def middle_values(values: np.ndarray, used: np.ndarray, count: np.ndarray) -> np.ndarray:
    """Upper median of the used values of every line, (L,); infinite without any."""
    ordered = np.where(used, values, np.inf)
    ordered.sort(axis=1)
    size = ordered.shape[1]
    return ordered.take([min(n // 2, size - 1) + k * size for k, n in enumerate(count.tolist())])
