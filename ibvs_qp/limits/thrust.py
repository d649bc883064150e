"""Thrust box and thrust rate of every rotor, hard."""

from __future__ import annotations

import casadi as ca

from ibvs_qp.limits.limit import Limit
from ibvs_qp.model.model import Model
from ibvs_qp.model.rows import LimitRow

#: Bound of a thrust with `thrust_rows` off [N]; finite, for solvers.
NO_LIMIT = 1e4


class ThrustLimit(Limit):
    """Each thrust within its box, and within the rate limit of the last one (`ibvs_qp.model.reach`)."""

    bound_settings = ("vehicle.thrust_min_n", "vehicle.thrust_max_n", "vehicle.thrust_rate_n_s")
    switch_setting = "thrust_rows"

    def rows(self, model: Model) -> list[LimitRow]:
        """One hard row per rotor in newtons."""
        lower, upper = model.thrust_lower, model.thrust_upper
        if not model.config.thrust_rows:
            lower, upper = ca.SX.ones(model.rotors) * -NO_LIMIT, ca.SX.ones(model.rotors) * NO_LIMIT
        return [
            LimitRow(name=f"thrust_{name}", unit="N", expression=model.thrust[i], lower=lower[i], upper=upper[i])
            for i, name in enumerate(model.config.vehicle.geometry.names)
        ]
