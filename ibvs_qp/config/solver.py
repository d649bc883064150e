"""Settings of OSQP and of the acceptance test."""

from __future__ import annotations

from dataclasses import dataclass

from ibvs_qp.config.settings import setting, validate


@dataclass(frozen=True, kw_only=True)
class SolverSettings:
    """OSQP and the acceptance test."""

    max_iterations: int = setting(200, "deterministic deadline", low=1, high=100000)
    tolerance: float = setting(1e-5, "eps_abs", low=1e-10, high=1e-1)
    relative_tolerance: float = setting(
        1e-6, "eps_rel; where limits bind the active rows are solved exactly afterwards", low=1e-10, high=1e-1
    )
    check_interval: int = setting(5, "iterations between termination checks", low=1, high=1000)
    adaptive_rho_interval: int = setting(25, "iterations between step-size updates", low=1, high=10000)
    scaling: int = setting(
        2, "Ruiz equilibration passes; ten cost 4 us more per tick and no iteration less", low=0, high=100
    )
    shortcut: bool = setting(
        True, "where no row binds, or the rows of the last tick do, the exact solution flies and OSQP is not asked"
    )
    polish: bool = setting(True, "solve the rows that OSQP found active exactly, and keep the answer if it is optimal")
    direct: bool = setting(True, "talk to OSQP's extension object (half the overhead) instead of its wrapper")
    accept_residual: float = setting(5e-2, "largest violation of a capped solution", unit="N", low=1e-9, high=10.0)

    def __post_init__(self) -> None:
        """Validate."""
        validate(self)
