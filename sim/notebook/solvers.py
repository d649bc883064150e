"""Notebook 05: solvers on the same recorded programs: time, distance to the exact thrusts, unanswered ticks."""

from __future__ import annotations

import gc
import importlib.util
import time
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import osqp
import qpsolvers
from scipy import sparse

from sim.notebook.internals import Answer, Program, exact_solver, shipped_osqp_settings, shipped_solver
from sim.notebook.table import number, table

#: Ticks that warm a solver up before the measurement.
WARM_UP = 20
#: Errors below this are rounding [N]; multipliers below this belong to inactive rows [cost per unit].
ROUNDING_N, ACTIVE = 1e-14, 1e-9
#: OSQP's own defaults (osqp.org, version 1.1), and interval of step-size updates beyond any cap on iterations.
OSQP_DEFAULTS = {"eps_abs": 1e-3, "eps_rel": 1e-3, "max_iter": 4000, "check_termination": 25,
                 "adaptive_rho_interval": 50, "scaling": 10}  # fmt: skip
NEVER = 10_000
#: Back ends of qpsolvers for a program of this kind, and those that take dense matrices.
BACK_ENDS, DENSE = ("osqp", "daqp", "quadprog", "proxqp", "piqp", "clarabel"), ("daqp", "quadprog")


@dataclass(frozen=True, kw_only=True)
class Contender:
    """A way to solve the ticks."""

    name: str  # in figures and tables
    family: str  # its colour: "OSQP, workspace", "active set", "qpsolvers", "shipped" or "yours"
    # sets it up for some programs and returns the function that solves one; only that function is timed
    make: Callable[[Sequence[Program]], Callable[[Program], Answer]]


@dataclass(frozen=True, kw_only=True)
class Result:
    """Measurements of one contender (N ticks)."""

    contender: Contender  # the contender
    times_us: np.ndarray  # thread time per tick [us], (N,)
    errors_n: np.ndarray  # largest distance of a thrust to the exact one [N], (N,); NaN without an answer
    iterations: np.ndarray  # of the solver, (N,); 0 where it reports none


def osqp_workspace(name: str, settings: dict[str, float], family: str = "OSQP, workspace") -> Contender:
    """One OSQP workspace for all ticks: values updated in place, warm start. Settings have OSQP's own names."""

    def make(programs: Sequence[Program]) -> Callable[[Program], Answer]:
        hessian = np.triu(np.any([program.hessian != 0.0 for program in programs], axis=0))
        rows = np.any([program.rows != 0.0 for program in programs], axis=0)
        hessian_at, rows_at = (np.nonzero(pattern.T)[::-1] for pattern in (hessian, rows))  # by columns, as CSC
        solver, first = osqp.OSQP(), programs[0]
        matrices = [sparse.csc_matrix(pattern.astype(float)) for pattern in (hessian, rows)]
        matrices[0].data, matrices[1].data = first.hessian[hessian_at], first.rows[rows_at]
        solver.setup(matrices[0], first.q.copy(), matrices[1], first.lower.copy(), first.upper.copy(),
                     verbose=False, warm_starting=True, **{**OSQP_DEFAULTS, **settings})  # fmt: skip

        def answer(program: Program) -> Answer:
            hessian, rows = program.hessian[hessian_at], program.rows[rows_at]
            solver.update(q=program.q, l=program.lower, u=program.upper, Px=hessian, Ax=rows)
            result = solver.solve(raise_error=False)
            return np.array(result.x), int(result.info.iter)

        return answer

    return Contender(name=name, family=family, make=make)


def _daqp_workspace(programs: Sequence[Program]) -> Callable[[Program], Answer]:
    import daqp  # pyright: ignore[reportMissingImports] -- from the extra "solvers"

    def arguments(program: Program) -> tuple[np.ndarray, ...]:
        return program.hessian, program.q.copy(), program.rows, program.upper.copy(), program.lower.copy()

    model = daqp.Model()
    model.setup(*arguments(programs[0]))

    def answer(program: Program) -> Answer:
        model.update(*arguments(program))
        x, _, flag, info = model.solve()
        return (np.array(x) if flag == 1 else None), int(info.get("iterations", 0))

    return answer


def _back_end(name: str) -> Callable[[Sequence[Program]], Callable[[Program], Answer]]:
    """A back end with its default settings, as a user of qpsolvers calls it: a new problem at every tick."""

    def answer(program: Program) -> Answer:
        hessian, rows = program.hessian, np.vstack((program.rows, -program.rows))
        if name not in DENSE:
            hessian, rows = sparse.csc_matrix(hessian), sparse.csc_matrix(rows)
        problem = qpsolvers.Problem(hessian, program.q, rows, np.concatenate((program.upper, -program.lower)))
        found = qpsolvers.solve_problem(problem, solver=name)
        return (found.x if found.found else None), 0

    return lambda programs: answer


def _casadi_daqp(programs: Sequence[Program]) -> Callable[[Program], Answer]:
    solve = exact_solver()
    return lambda program: (solve(program)[0], 0)


def contenders() -> list[Contender]:
    """OSQP at several tolerances, the shipped engine, DAQP, and the installed back ends of qpsolvers."""
    found = [osqp_workspace("OSQP defaults", {})]
    for power in (3, 4, 5, 6, 8):
        tolerance = {"eps_abs": 10.0**-power, "eps_rel": 10.0**-power}
        settings = {"check_termination": 5, "adaptive_rho_interval": 25, **tolerance}
        found.append(osqp_workspace(f"OSQP 1e-{power}", settings))
    found.append(osqp_workspace("OSQP, shipped settings", shipped_osqp_settings()))
    found.append(Contender(name="shipped", family="shipped", make=lambda programs: shipped_solver()))
    found.append(Contender(name="DAQP in CasADi", family="active set", make=_casadi_daqp))
    if importlib.util.find_spec("daqp") is not None:
        found.append(Contender(name="DAQP, workspace", family="active set", make=_daqp_workspace))
    installed = [name for name in BACK_ENDS if name in qpsolvers.available_solvers]
    return [*found, *(Contender(name=f"qpsolvers {n}", family="qpsolvers", make=_back_end(n)) for n in installed)]


def transition(programs: Sequence[Program], count: int) -> slice:
    """The `count` consecutive ticks of which about half are limited.

    Raises:
        ValueError: When there are fewer ticks.
    """
    if count > len(programs):
        raise ValueError(f"{count} ticks requested, {len(programs)} recorded")
    total = np.cumsum([0, *(program.limited for program in programs)])
    begin = int(np.abs((total[count:] - total[:-count]) / count - 0.5).argmin())
    return slice(begin, begin + count)


def exact_solutions(programs: Sequence[Program]) -> tuple[np.ndarray, np.ndarray]:
    """Solutions by DAQP, refined on its active rows, (N, variables), and their `optimality_residual`, (N,)."""
    solve, solutions, residuals = exact_solver(), [], []
    for program in programs:
        x, y = solve(program)
        active = np.abs(y) > ACTIVE
        rows, size = program.rows[active], len(x)
        bounds = np.where(y > 0.0, program.upper, program.lower)[active]
        system = np.block([[program.hessian, rows.T], [rows, np.zeros((len(rows), len(rows)))]])
        refined = np.linalg.solve(system, np.concatenate((-program.q, bounds)))
        x, y = refined[:size], np.zeros(len(y))
        y[active] = refined[size:]
        solutions.append(x)
        residuals.append(optimality_residual(program, x, y))
    return np.array(solutions), np.array(residuals)


def optimality_residual(program: Program, x: np.ndarray, y: np.ndarray) -> float:
    r"""Largest violation of stationarity, bounds and complementarity, each relative to its own scale [-].

    .. math:: P x + q + A^T y = 0, \quad l \le A x \le u, \quad y_+ (u - A x) = 0, \; y_- (A x - l) = 0
    """
    at, scale = program.rows @ x, np.abs(program.q).max()
    stationary = np.abs(program.hessian @ x + program.q + program.rows.T @ y).max() / scale
    outside = np.maximum(program.lower - at, at - program.upper).max() / np.abs(at).max()
    slack = np.where(y > 0.0, y * (program.upper - at), -y * (at - program.lower))
    return float(max(stationary, outside, np.abs(slack).max() / scale))


def race(contender: Contender, programs: Sequence[Program], exact: np.ndarray, repeats: int = 1) -> Result:
    """Solve every tick in order with one contender.

    Args:
        contender: The contender.
        programs: N ticks.
        exact: Their solutions, (N, variables).
        repeats: Passes through the ticks; the fastest time of a tick and its first answer count.
    """
    rotors, times, errors, iterations = len(programs[0].free), [], [], []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # some back ends warn that they convert a sparse matrix
        answer = contender.make(programs)
        for program in programs[:WARM_UP]:
            answer(program)
        for _ in range(repeats):
            spent = []
            gc.disable()  # a garbage collection would count as time of one tick
            for index, program in enumerate(programs):
                start = time.thread_time_ns()
                x, count = answer(program)
                spent.append(1e-3 * (time.thread_time_ns() - start))
                if len(errors) < len(programs):
                    errors.append(np.nan if x is None else np.abs(x[:rotors] - exact[index, :rotors]).max())
                    iterations.append(count)
            gc.enable()
            times.append(spent)
    return Result(
        contender=contender,
        times_us=np.min(times, axis=0),
        errors_n=np.maximum(errors, ROUNDING_N),
        iterations=np.array(iterations),
    )


def race_table(results: Sequence[Result], reference: str = "shipped") -> str:
    """Times relative to one contender, and errors [N], the fastest median first, as markdown."""
    base = next((np.median(one.times_us) for one in results if one.contender.name == reference), np.nan)
    rows = []
    for one in sorted(results, key=lambda each: np.median(each.times_us)):
        times = np.percentile(one.times_us, [50.0, 99.0]) / base
        errors = (number(value, ".1e") for value in np.nanpercentile(one.errors_n, [50.0, 99.0]))
        counts = f"{np.median(one.iterations):.0f} / {one.iterations.max()}" if one.iterations.any() else "–"
        rows.append((one.contender.name, *map(number, times), *errors, counts, np.isnan(one.errors_n).sum()))
    return table(
        ["solver", f"median time, {reference} = 1", "99 % of ticks within", "error, median [N]", "error, 99 % [N]",
         "iterations, median / most", "no answer"], rows,
    )  # fmt: skip
