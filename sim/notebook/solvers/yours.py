"""OSQP as a reader sets it with sliders."""

from __future__ import annotations

from ibvs_qp.config import SolverSettings


def your_settings(
    power: int, most: int, check_interval: int, adaptive_rho_interval: int, scaling: int
) -> SolverSettings:
    """Settings of a kept workspace that is asked at every tick.

    Args:
        power: Tolerance is 10 to the minus this, absolute and relative.
        most: Iterations at most.
        check_interval: Iterations between termination tests.
        adaptive_rho_interval: Iterations between step-size updates.
        scaling: Equilibration passes.
    """
    return SolverSettings(
        tolerance=10.0**-power,
        relative_tolerance=10.0**-power,
        max_iterations=most,
        check_interval=check_interval,
        adaptive_rho_interval=adaptive_rho_interval,
        scaling=scaling,
    )
