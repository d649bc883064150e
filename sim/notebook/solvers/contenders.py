"""Solvers in one shape: set up for a program's structure, then asked tick by tick."""

from __future__ import annotations

import dataclasses
import importlib.util
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ibvs_qp.config import SolverSettings
from ibvs_qp.qp.accept import QpEngine
from ibvs_qp.qp.evaluator import ProgramData
from ibvs_qp.qp.exact import ExactSolver
from ibvs_qp.qp.offline import installed_solvers, solve_offline
from ibvs_qp.qp.osqp import OsqpSolver
from ibvs_qp.qp.problem import QpTemplate

#: One tick: the solution x, (variables,), or None; and iterations, 0 where a solver does not say.
Answer = tuple[np.ndarray | None, int]
#: OSQP as people meet it: its own defaults (osqp.org, version 1.1).
OSQP_DEFAULTS = SolverSettings(
    max_iterations=4000,
    tolerance=1e-3,
    relative_tolerance=1e-3,
    check_interval=25,
    adaptive_rho_interval=50,
    scaling=10,
)
#: Back ends of qpsolvers that take a dense or sparse program of this kind.
BACK_ENDS = ("osqp", "daqp", "quadprog", "proxqp", "piqp", "clarabel")


@dataclass(frozen=True, kw_only=True)
class Contender:
    """A way to solve the ticks.

    Attributes:
        name: In figures and tables.
        family: What it is drawn with: "OSQP, kept", "active set", "qpsolvers", "ours" or "yours".
        make: Sets it up for a program and gives the function that answers ticks; only the answers are timed.
    """

    name: str
    family: str
    make: Callable[[QpTemplate], Callable[[ProgramData], Answer]]


def kept_osqp(name: str, settings: SolverSettings, family: str = "OSQP, kept") -> Contender:
    """One workspace for all ticks, values updated in place, warm started."""

    def make(template: QpTemplate) -> Callable[[ProgramData], Answer]:
        solver = OsqpSolver(template, settings)

        def answer(data: ProgramData) -> Answer:
            raw = solver.solve(data.p, data.q, data.a, data.lower, data.upper)
            if raw is None:
                return None, 0
            return raw.x, raw.iterations

        return answer

    return Contender(name=name, family=family, make=make)


def flown(name: str, settings: SolverSettings) -> Contender:
    """The controller's solve: OSQP, acceptance test, DAQP where the test fails."""

    def make(template: QpTemplate) -> Callable[[ProgramData], Answer]:
        engine = QpEngine(template, settings)

        def answer(data: ProgramData) -> Answer:
            engine.data = _Evaluated(data)  # type: ignore[assignment]
            found = engine.solve()
            return (None, 0) if found is None else (found.x, found.iterations)

        return answer

    return Contender(name=name, family="ours", make=make)


class _Evaluated:
    """Data that is up to date already, as the compiled tick leaves it: evaluating is not the solver's work."""

    def __init__(self, data: ProgramData) -> None:
        self._data = data

    def evaluate(self) -> None:
        """Nothing to do."""

    def __getattr__(self, name: str) -> Any:
        return getattr(self._data, name)


def casadi_daqp() -> Contender:
    """The exact fallback of the controller: DAQP through CasADi, from scratch at every tick."""

    def make(template: QpTemplate) -> Callable[[ProgramData], Answer]:
        solver = ExactSolver(template)

        def answer(data: ProgramData) -> Answer:
            found = solver.solve(data.p, data.q, data.a, data.lower, data.upper)
            return (None, 0) if found is None else (found[0], 0)

        return answer

    return Contender(name="DAQP in CasADi", family="active set", make=make)


def kept_daqp() -> Contender:
    """DAQP's own binding: one workspace, data updated in place."""

    def make(template: QpTemplate) -> Callable[[ProgramData], Answer]:
        import daqp  # pyright: ignore[reportMissingImports] -- from the extra "solvers"

        model, ready = daqp.Model(), False

        def answer(data: ProgramData) -> Answer:
            nonlocal ready
            arguments = data.hessian(), data.q.copy(), data.rows(), data.upper.copy(), data.lower.copy()
            (model.update if ready else model.setup)(*arguments)
            ready = True
            x, _, flag, info = model.solve()
            return (np.array(x) if flag == 1 else None), int(info.get("iterations", 0))

        return answer

    return Contender(name="DAQP, kept", family="active set", make=make)


def qpsolvers_back_end(name: str) -> Contender:
    """A back end as a user of qpsolvers calls it: a new problem at every tick, its default settings."""

    def make(template: QpTemplate) -> Callable[[ProgramData], Answer]:
        def answer(data: ProgramData) -> Answer:
            found = solve_offline(template, data, name)
            return (None, 0) if found is None else (found[0], 0)

        return answer

    return Contender(name=f"qpsolvers {name}", family="qpsolvers", make=make)


def field() -> list[Contender]:
    """Everybody who is installed: OSQP at several tolerances, DAQP, qpsolvers' back ends, and what flies."""
    tight = dataclasses.replace(OSQP_DEFAULTS, check_interval=5, adaptive_rho_interval=25)
    contenders = [kept_osqp("OSQP defaults", OSQP_DEFAULTS)]
    for power in (3, 4, 5, 6, 8):
        settings = dataclasses.replace(tight, tolerance=10.0**-power, relative_tolerance=10.0**-power)
        contenders.append(kept_osqp(f"OSQP 1e-{power}", settings))
    contenders.append(flown("shipped", SolverSettings()))
    contenders.append(casadi_daqp())
    if importlib.util.find_spec("daqp") is not None:
        contenders.append(kept_daqp())
    return [*contenders, *(qpsolvers_back_end(name) for name in BACK_ENDS if name in installed_solvers())]
