"""OSQP's settings one against the other: tolerance and step-size updates, in errors and iterations, not in time."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sim.notebook.solvers.contenders import OSQP_DEFAULTS, kept_osqp
from sim.notebook.solvers.programs import Stretch
from sim.notebook.solvers.race import Exact, race

#: Interval of step-size updates that no cap ever reaches.
NEVER = 10_000


@dataclass(frozen=True, kw_only=True)
class SettingsRow:
    """OSQP at one setting, no exact solve afterwards.

    Attributes:
        tolerance: eps_abs and eps_rel.
        interval: Iterations between updates of the step size rho; `NEVER` keeps it.
        error_n: 99th percentile of the thrust error [N].
        iterations: Median of the ticks.
        iterations_p99: 99th percentile of the ticks.
    """

    tolerance: float
    interval: int
    error_n: float
    iterations: float
    iterations_p99: float


def settings_grid(
    stretch: Stretch, exact: Exact, tolerances: Sequence[float], intervals: Sequence[int], cap: int
) -> list[SettingsRow]:
    """Every tolerance with every interval of step-size updates.

    Args:
        stretch: The ticks.
        exact: Their solutions.
        tolerances: eps_abs = eps_rel.
        intervals: Iterations between updates of rho.
        cap: Iterations at most.
    """
    rows = []
    for interval in intervals:
        for tolerance in tolerances:
            settings = dataclasses.replace(
                OSQP_DEFAULTS,
                tolerance=tolerance,
                relative_tolerance=tolerance,
                adaptive_rho_interval=interval,
                check_interval=5,
                max_iterations=cap,
            )
            result = race(kept_osqp("grid", settings), stretch, exact)
            rows.append(
                SettingsRow(
                    tolerance=tolerance,
                    interval=interval,
                    error_n=float(np.nanpercentile(result.errors_n, 99.0)),
                    iterations=float(np.median(result.iterations)),
                    iterations_p99=float(np.percentile(result.iterations, 99.0)),
                )
            )
    return rows
