"""Thrust box and thrust rate of every rotor, hard."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from ibvs_qp.limits.limit import Limit
from ibvs_qp.model.rows import LimitRow, SymbolicModel

#: Least distance between lower and upper bound [N]: OSQP takes a row for an equality below 1e-4 and refactorises.
LEAST_GAP = 1e-3
#: Bound of a thrust that the program shall not know limits of [N]; finite, for solvers.
NO_LIMIT = 1e4


class ThrustLimit(Limit):
    """Each thrust within its box and within reach of the last one at the rate limit."""

    bounded_by = ("vehicle.thrust_min_n", "vehicle.thrust_max_n", "vehicle.thrust_rate_n_s")
    switched_by = "thrust_rows"

    def rows(self, model: SymbolicModel) -> list[LimitRow]:
        """One hard row per rotor in newtons."""
        lower = model.parameter("thrust_lower", model.rotors)
        upper = model.parameter("thrust_upper", model.rotors)
        names = model.config.vehicle.geometry.names
        if not model.config.thrust_rows:
            lower, upper = ca.SX.ones(model.rotors) * -NO_LIMIT, ca.SX.ones(model.rotors) * NO_LIMIT
        return [
            LimitRow(name=f"thrust_{names[i]}", unit="N", expression=model.thrust[i], lower=lower[i], upper=upper[i])
            for i in range(model.rotors)
        ]


def thrust_window(last: Any, lower: Any, upper: Any, step: Any, floor: Any, ceiling: Any) -> tuple[Any, Any]:
    """Box and rate limit of one tick, never empty: a limit lowered in flight is approached at the rate limit.

    Args:
        last: Last thrusts [N], (n,); arrays or symbols, like all that follow.
        lower: Lower limits now in force [N], (n,).
        upper: Upper limits now in force [N], (n,).
        step: Largest change in one tick [N].
        floor: Absolute lower limits that hold whatever happens [N], (n,).
        ceiling: Absolute upper limits [N], (n,).

    Returns:
        Lower and upper bounds [N], (n,) each, at least `LEAST_GAP` apart.
    """
    least, most = (np.minimum, np.maximum) if isinstance(last, np.ndarray) else (ca.fmin, ca.fmax)
    reach_low, reach_high = last - step, last + step
    low = least(most(lower, reach_low), reach_high - LEAST_GAP)
    high = most(least(upper, most(reach_high, low + LEAST_GAP)), most(reach_low, low) + LEAST_GAP)
    low = least(most(low, floor), ceiling - LEAST_GAP)
    return low, least(most(high, low + LEAST_GAP), ceiling)
