"""Where along a line its profiles agree with it: the longest run of them."""

from __future__ import annotations

import numpy as np

from ibvs_qp.vision.kernels import line_tables as t
from ibvs_qp.vision.kernels.compile import inner


@inner
def keep_run(
    good: np.ndarray,
    visible: np.ndarray,
    distance: np.ndarray,
    alive: bool,
    gate: float,
    bridge: int,
    min_profiles: int,
    fit: np.ndarray,
) -> int:
    """Keep the profiles within the gate that lie in the longest run of them, and say how many these are.

    Args:
        good: Profiles that have an edge, uint8 (K,); those that agree are kept.
        visible: Profiles that could be seen, uint8 (K,).
        distance: Of the edges from the line [px], (K,).
        alive: Whether there is a line.
        gate: Distance within which a profile agrees [px].
        bridge: Visible misses in a row that do not end the run.
        min_profiles: Least profiles that have an edge.
        fit: Filled with count, run and whether there still is a line, a row of `line_tables`.
    """
    profiles, held = len(good), 0
    for k in range(profiles):
        held += good[k]
    alive = alive and held >= min_profiles
    for k in range(profiles):
        good[k] = alive and good[k] != 0 and abs(distance[k]) < gate
    first, last = _longest_run(good, visible, bridge)
    count, seen = 0, 0
    for k in range(profiles):
        if not first <= k <= last:
            good[k] = 0
            continue
        count += good[k]
        seen += good[k] != 0 or visible[k] != 0
    fit[t.FIT_COUNT], fit[t.FIT_SEEN], fit[t.FIT_FIRST], fit[t.FIT_LAST] = count, seen, first, last
    fit[t.FIT_ALIVE] = alive
    return count


@inner
def _longest_run(support: np.ndarray, visible: np.ndarray, bridge: int) -> tuple[int, int]:
    """First and last point of the run with most support, (0, 0) without any.

    Up to `bridge` visible misses in a row are bridged; hidden places never break a run.
    """
    first, last, start, held, most, missed = 0, 0, -1, 0, 0, 0
    for k in range(len(support)):
        if not support[k]:
            missed += visible[k] != 0
            continue
        if start < 0 or missed > bridge:
            start, held = k, 0
        held, missed = held + 1, 0
        if held > most:
            most, first, last = held, start, k
    return first, last
