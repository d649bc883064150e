"""Medians."""

from __future__ import annotations

import numpy as np

from ibvs_qp.vision.kernels.compile import inner


@inner
def upper_median(values: np.ndarray, count: int) -> float:
    """Upper median of the first ``count`` values, which it reorders (quickselect); infinite without any."""
    if count == 0:
        return np.inf
    low, high, middle = 0, count - 1, count // 2
    while low < high:
        pivot = values[(low + high) // 2]
        i, j = low, high
        while i <= j:
            while values[i] < pivot:
                i += 1
            while values[j] > pivot:
                j -= 1
            if i <= j:
                values[i], values[j] = values[j], values[i]
                i += 1
                j -= 1
        if middle <= j:
            high = j
        elif middle >= i:
            low = i
        else:
            break
    return values[middle]
