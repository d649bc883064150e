"""Solvers in one shape: set up for a program's structure, then asked tick by tick."""

from __future__ import annotations

import dataclasses
import importlib.util
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import qpsolvers
from scipy import sparse

from ibvs_qp.config import SolverSettings
from ibvs_qp.qp.assembly import QpTemplate
from ibvs_qp.qp.evaluator import ProgramData
from ibvs_qp.qp.exact_solver import ExactSolver
from ibvs_qp.qp.osqp_solver import OsqpSolver
from ibvs_qp.qp.polish import polished

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
    polish=False,
    shortcut=False,
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
    """One workspace for all ticks, values updated in place, warm started.

    With `settings.polish` the active rows are solved exactly afterwards; with `settings.shortcut` the optimum without
    limits is taken where it breaks none, as the controller does.
    """

    def make(template: QpTemplate) -> Callable[[ProgramData], Answer]:
        solver, slacks = OsqpSolver(template, settings), np.zeros(len(template.variable_names) - template.model.rotors)

        def answer(data: ProgramData) -> Answer:
            if settings.shortcut and data.violation[0] <= 0.0:
                return np.append(data.free, slacks), 0
            raw = solver.solve(data.p, data.q, data.a, data.lower, data.upper)
            if raw is None:
                return None, 0
            exact = polished(data, raw.x, raw.y) if settings.polish else None
            return (raw.x if exact is None else exact[0]), raw.iterations

        return answer

    return Contender(name=name, family=family, make=make)


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
        import daqp

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
        p, a = template.p_pattern.copy(), template.a_pattern.copy()

        def answer(data: ProgramData) -> Answer:
            p.data, a.data = data.p.copy(), data.a.copy()
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                problem = qpsolvers_problem(p, a, data, dense=name not in qpsolvers.sparse_solvers)
                return qpsolvers.solve_problem(problem, solver=name).x, 0

        return answer

    return Contender(name=f"qpsolvers {name}", family="qpsolvers", make=make)


def qpsolvers_problem(p: sparse.csc_matrix, a: sparse.csc_matrix, data: ProgramData, dense: bool) -> qpsolvers.Problem:
    """A program as qpsolvers wants it: full P, two-sided rows stacked; dense where a back end knows nothing else."""
    full, rows = sparse.csc_matrix(p + sparse.triu(p, 1).T), sparse.csc_matrix(sparse.vstack((a, -a)))
    matrices: tuple[Any, Any] = (full.toarray(), rows.toarray()) if dense else (full, rows)
    return qpsolvers.Problem(matrices[0], data.q, matrices[1], np.concatenate((data.upper, -data.lower)))


def field() -> list[Contender]:
    """Everybody who is installed: OSQP at several tolerances, DAQP, qpsolvers' back ends, and what flies."""
    tight = dataclasses.replace(OSQP_DEFAULTS, check_interval=5, adaptive_rho_interval=25)
    contenders = [kept_osqp("OSQP defaults", OSQP_DEFAULTS)]
    for power in (3, 4, 5, 6, 8):
        settings = dataclasses.replace(tight, tolerance=10.0**-power, relative_tolerance=10.0**-power)
        contenders.append(kept_osqp(f"OSQP 1e-{power}", settings))
    shipped = SolverSettings()
    contenders.append(kept_osqp("shipped, always OSQP", dataclasses.replace(shipped, shortcut=False), "ours"))
    contenders.append(kept_osqp("shipped", shipped, "ours"))
    contenders.append(casadi_daqp())
    if importlib.util.find_spec("daqp") is not None:
        contenders.append(kept_daqp())
    return [*contenders, *(qpsolvers_back_end(name) for name in BACK_ENDS if name in qpsolvers.available_solvers)]
