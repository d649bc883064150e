"""Settings of OSQP and of the acceptance test."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ibvs_qp.config.errors import out_of_range
from ibvs_qp.config.settings import Checked, choice, setting

#: Solvers by name: the files of ``ibvs_qp/qp/solvers``, not imported here because they load the libraries.
SOLVERS = tuple(sorted(file.stem for file in (Path(__file__).parents[1] / "qp" / "solvers").glob("[!_]*.py")))


@dataclass(frozen=True, kw_only=True)
class SolverSettings(Checked):
    """Solver and acceptance test; the values are measured on recorded flights (docs/how_it_works/qp.md)."""

    max_iterations: int = setting(500, "deterministic deadline; an iteration takes about 0.5 us", low=1, high=100000)
    tolerance: float = setting(1e-6, "eps_abs; leaves at most 1e-3 N in the softest direction", low=1e-10, high=1e-1)
    relative_tolerance: float = setting(0.0, "eps_rel; relaxes the test in soft directions", low=0.0, high=1e-1)
    check_interval: int = setting(5, "iterations between termination checks", low=1, high=1000)
    adaptive_rho_interval: int = setting(20, "iterations between step-size updates; 10 oscillate", low=1, high=10000)
    adaptive_rho_tolerance: float = setting(2.0, "step-size change that triggers an update", low=1.0, high=100.0)
    scaling: int = setting(2, "Ruiz equilibration passes; with 0 or 10 some ticks end at the cap", low=0, high=100)
    name: str = choice(
        "osqp", "solver that is tried first at every tick; all but OSQP are of the extra `solvers`", SOLVERS
    )
    backend: str = choice(
        "python",
        "solver and equations in Python, or as C code compiled once: same thrusts, a third of the time",
        ("python", "compiled"),
    )
    direct: bool = setting(True, "call OSQP's extension object (half the overhead) instead of its wrapper")
    accept_residual: float = setting(1e-3, "largest residual of an accepted early stop, as thrust", "N", 1e-9, 10.0)
    recovery_ticks: int = setting(25, "good solutions in a row until QP control resumes: 0.1 s", low=0, high=10000)

    def __post_init__(self) -> None:
        """Validate; only OSQP exists as C code."""
        super().__post_init__()
        if self.backend == "compiled" and self.name != "osqp":
            raise out_of_range("name", self.name, "", "allowed with backend = 'compiled' is osqp")
