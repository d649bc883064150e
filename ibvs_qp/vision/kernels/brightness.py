"""Brightness of a picture against the one before."""

from __future__ import annotations

import numpy as np

from ibvs_qp.vision.kernels.compile import kernel

#: Least share of the pixels that must be unsaturated in both pictures.
_LEAST = 0.05


@kernel("f8(u1[:, :, ::1], u1[:, :, ::1], i8)")
def brightness_ratio(before: np.ndarray, after: np.ndarray, saturated: int) -> float:
    """Median ratio of the pixels' brightness, so that what moves does not count; 1 where nearly all are saturated.

    Args:
        before: Picture, (H, W, 3).
        after: The next one, (H, W, 3).
        saturated: Pixels with a channel of at least this do not count [grey levels].
    """
    ratios, count = np.empty(before.shape[0] * before.shape[1]), 0
    for v in range(before.shape[0]):
        for u in range(before.shape[1]):
            one, two = before[v, u], after[v, u]
            if max(one[0], one[1], one[2]) < saturated and max(two[0], two[1], two[2]) < saturated:
                one_sum = np.int64(one[0]) + np.int64(one[1]) + np.int64(one[2])
                two_sum = np.int64(two[0]) + np.int64(two[1]) + np.int64(two[2])
                ratios[count] = (two_sum + 1.0) / (one_sum + 1.0)
                count += 1
    return np.median(ratios[:count]) if count >= _LEAST * ratios.size else 1.0
