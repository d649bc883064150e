"""Thrust window of one step: the intersection of box and rate limit, never empty."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

#: Least distance between lower and upper bound [N]: OSQP takes a row for an equality below 1e-4 and refactorises.
LEAST_GAP = 1e-3


def thrust_window(last: Any, lower: Any, upper: Any, step: Any, floor: Any, ceiling: Any) -> tuple[Any, Any]:
    """Bounds of the thrusts: a limit lowered in flight is approached at the rate limit.

    Args:
        last: Last thrusts [N], (n,); arrays or symbols, like all that follow.
        lower: Lower limits now in force [N], (n,).
        upper: Upper limits now in force [N], (n,).
        step: Largest change in one step [N].
        floor: Lower limits of the vehicle [N], (n,).
        ceiling: Upper limits of the vehicle [N], (n,).

    Returns:
        Lower and upper bounds [N], (n,) each, at least `LEAST_GAP` apart.
    """
    least, most = (np.minimum, np.maximum) if isinstance(last, np.ndarray) else (ca.fmin, ca.fmax)
    reach_low, reach_high = last - step, last + step
    low = least(most(lower, reach_low), reach_high - LEAST_GAP)
    high = most(least(upper, most(reach_high, low + LEAST_GAP)), most(reach_low, low) + LEAST_GAP)
    low = least(most(low, floor), ceiling - LEAST_GAP)
    return low, least(most(high, low + LEAST_GAP), ceiling)
