"""Solvers called by their own interface on arrays that are ready: the solver alone, without assembly."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable

import numpy as np

from ibvs_qp.qp.problem import ProgramData

#: Solves the program of a tick and returns its variables; it is prepared for that tick, and only the call is timed.
Call = Callable[[], np.ndarray]


def direct_solvers() -> dict[str, Callable[[ProgramData], Call]]:
    """What prepares the call for a tick, by solver; those that are not installed are left out."""
    every = {"daqp": ("daqp", _daqp), "quadprog": ("quadprog", _quadprog), "proxqp": ("proxsuite", _proxqp)}
    return {name: make() for name, (module, make) in every.items() if importlib.util.find_spec(module)}


def _daqp() -> Callable[[ProgramData], Call]:
    import daqp  # pyright: ignore[reportMissingImports] -- from the extra "solvers"

    def prepare(data: ProgramData) -> Call:
        hessian, q, rows, lower, upper = _arrays(data)
        return lambda: daqp.solve(hessian, q, rows, upper, lower)[0]

    return prepare


def _quadprog() -> Callable[[ProgramData], Call]:
    import quadprog  # pyright: ignore[reportMissingImports] -- from the extra "solvers"

    def prepare(data: ProgramData) -> Call:
        hessian, q, rows, lower, upper = _arrays(data)
        sides, bounds = np.vstack((rows, -rows)).T.copy(), np.concatenate((lower, -upper))
        return lambda: quadprog.solve_qp(hessian, -q, sides, bounds)[0]

    return prepare


def _proxqp() -> Callable[[ProgramData], Call]:
    """One workspace for all ticks, with warm start."""
    from proxsuite import proxqp  # pyright: ignore[reportMissingImports] -- from the extra "solvers"

    workspaces = []

    def prepare(data: ProgramData) -> Call:
        hessian, q, rows, lower, upper = _arrays(data)
        if not workspaces:
            workspaces.append(proxqp.dense.QP(len(q), 0, len(lower)))
            workspaces[0].init(hessian, q, None, None, rows, lower, upper)
        workspace = workspaces[0]

        def call() -> np.ndarray:
            workspace.update(hessian, q, None, None, rows, lower, upper)
            workspace.solve()
            return workspace.results.x

        return call

    return prepare


def _arrays(data: ProgramData) -> tuple[np.ndarray, ...]:
    """P and A in full, q and bounds, of a tick; copies, as the solvers write into some of them."""
    return data.hessian(), data.q.copy(), data.rows(), data.lower.copy(), data.upper.copy()
