"""Notebook 05: solvers on the same recorded programs: time, distance to the exact thrusts, unanswered ticks."""

from __future__ import annotations

import contextlib
import gc
import time
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import qpsolvers
from matplotlib.figure import Figure

from ibvs_qp.config import SolverSettings
from ibvs_qp.config.errors import ConfigError
from ibvs_qp.config.solver import SOLVERS
from ibvs_qp.controller import HybridController
from ibvs_qp.qp.exact import ExactSolver
from ibvs_qp.qp.solver import Solver, make_solver
from sim.bench.qp import DENSE, qpsolvers_problem
from sim.figures.style import legend_below, new_figure
from sim.notebook.common import BLUE, GREEN, LIMITED, number, shade, table
from sim.notebook.internals import Answer, Program, shipped_solver

#: Ticks that warm a solver up before the measurement.
WARM_UP = 20
#: Errors below this are rounding [N]; multipliers below this belong to inactive rows [cost per unit].
ROUNDING_N, ACTIVE = 1e-14, 1e-9
#: OSQP's own defaults (osqp.org, version 1.1), and interval of step-size updates beyond any cap on iterations.
OSQP_DEFAULTS = SolverSettings(
    tolerance=1e-3, relative_tolerance=1e-3, max_iterations=4000, check_interval=25, adaptive_rho_interval=50,
    adaptive_rho_tolerance=5.0, scaling=10,
)  # fmt: skip
NEVER = 10_000
#: Colours by family.
COLOURS = {"workspace": BLUE, "shipped": "#c2410c", "exact": GREEN, "qpsolvers": "#8a8a8a", "yours": "#7b3fa0"}
#: Thrust error that is small against the noise of the thrusts [N], and time between two ticks [us].
SMALL_N, TICK_US = 1e-2, 4000.0


@dataclass(frozen=True, kw_only=True)
class Contender:
    """A way to solve the ticks."""

    name: str  # in figures and tables
    family: str  # its colour
    make: Callable[[], Callable[[Program], Answer]]  # sets it up and returns the timed function of one program


@dataclass(frozen=True, kw_only=True)
class Result:
    """Measurements of one contender (N ticks)."""

    contender: Contender  # the contender
    times_us: np.ndarray  # thread time per tick [us], (N,)
    errors_n: np.ndarray  # largest distance of a thrust to the exact one [N], (N,); NaN without an answer
    iterations: np.ndarray  # of the solver, (N,); 0 where it reports none


def workspace(name: str, settings: SolverSettings, family: str = "workspace") -> Contender:
    """A solver of `solver.name` without the acceptance test, warm from tick to tick."""
    solver = make_solver(HybridController().problem, settings)
    return Contender(name=name, family=family, make=lambda: _answer_of(solver))


def _answer_of(solver: Solver) -> Callable[[Program], Answer]:
    solver.reset()

    def answer(program: Program) -> Answer:
        found = solver.solve(*program.values)
        return (None, 0) if found is None else (found.x, found.iterations)

    return answer


def _back_end(name: str) -> Callable[[Program], Answer]:
    """A back end with its default settings, as a user of qpsolvers calls it: a new problem at every tick."""
    problem = HybridController().problem

    def answer(program: Program) -> Answer:
        found = qpsolvers.solve_problem(qpsolvers_problem(problem, program.values, name in DENSE), solver=name)
        return (found.x if found.found else None), 0

    return answer


def contenders() -> list[Contender]:
    """OSQP at several tolerances, the shipped engine, and the installed solvers directly and through qpsolvers."""
    found = [workspace("OSQP defaults", OSQP_DEFAULTS)]
    for power in (3, 4, 5, 6, 8):
        settings = SolverSettings(tolerance=10.0**-power, relative_tolerance=10.0**-power, adaptive_rho_interval=25)
        found.append(workspace(f"OSQP 1e-{power}", settings))
    found.append(Contender(name="shipped", family="shipped", make=shipped_solver))
    exact = ExactSolver(HybridController().problem)
    found.append(Contender(name="DAQP in CasADi", family="exact", make=lambda: _answer_of(exact)))
    for name in SOLVERS:
        with contextlib.suppress(ConfigError):  # its library is not installed
            found.append(workspace(f"{name}, shipped settings", SolverSettings(name=name)))
    installed = [name for name in SOLVERS if name in qpsolvers.available_solvers]
    return found + [
        Contender(name=f"qpsolvers {name}", family="qpsolvers", make=lambda name=name: _back_end(name))
        for name in installed
    ]


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
    problem = HybridController().problem
    solver, solutions, residuals = ExactSolver(problem), [], []
    for program in programs:
        found = solver.solve(*program.values)
        assert found is not None, "a recorded program has no solution"
        active = np.abs(found.y) > ACTIVE
        hessian, rows = solver.dense.hessian(program.values.p), solver.dense.rows(program.values.a)
        bounds = np.where(found.y > 0.0, program.values.upper, program.values.lower)[active]
        system = np.block([[hessian, rows[active].T], [rows[active], np.zeros((active.sum(), active.sum()))]])
        refined = np.linalg.solve(system, np.concatenate((-program.values.q, bounds)))
        y = np.zeros(len(active))
        y[active] = refined[len(found.x) :]
        solutions.append(refined[: len(found.x)])
        residuals.append(optimality_residual(qpsolvers_problem(problem, program.values), solutions[-1], y))
    return np.array(solutions), np.array(residuals)


def optimality_residual(problem: qpsolvers.Problem, x: np.ndarray, y: np.ndarray) -> float:
    """Largest primal and dual residual and duality gap, each relative to its own scale [-]."""
    found = qpsolvers.Solution(problem, found=True, x=x, z=np.concatenate((np.maximum(y, 0.0), np.maximum(-y, 0.0))))
    cost = abs(0.5 * x @ problem.P @ x + problem.q @ x)
    scales = (np.abs(problem.G @ x).max(), np.abs(problem.q).max(), cost)
    parts = (found.primal_residual(), found.dual_residual(), found.duality_gap())
    return max(float(part / scale) for part, scale in zip(parts, scales, strict=True))


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
        answer = contender.make()
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
    for one in _by_time(results):
        times = np.percentile(one.times_us, [50.0, 99.0]) / base
        errors = (number(value, ".1e") for value in np.nanpercentile(one.errors_n, [50.0, 99.0]))
        counts = f"{np.median(one.iterations):.0f} / {one.iterations.max()}" if one.iterations.any() else "–"
        rows.append((one.contender.name, *map(number, times), *errors, counts, np.isnan(one.errors_n).sum()))
    return table(
        ["solver", f"median time, {reference} = 1", "99 % of ticks within", "error, median [N]", "error, 99 % [N]",
         "iterations, median / most", "no answer"], rows,
    )  # fmt: skip


def _by_time(results: Sequence[Result]) -> list[Result]:
    return sorted(results, key=lambda one: np.median(one.times_us))


def draw_race(results: Sequence[Result]) -> Figure:
    """Time of a tick and error of its thrusts by solver, the fastest first: dot at the median, line to 99 %."""
    results = _by_time(results)
    figure = new_figure(0.9 + 0.21 * len(results))
    times, errors = figure.subplots(1, 2, sharey=True)
    for place, one in enumerate(results):
        for axes, values in ((times, one.times_us), (errors, one.errors_n)):
            middle, end = np.nanpercentile(values, [50.0, 99.0])
            axes.plot([middle, end], [place, place], "o-", color=COLOURS[one.contender.family], markevery=[0])
    times.set_yticks(range(len(results)), [one.contender.name for one in results])
    times.invert_yaxis()
    times.set(xscale="log", xlabel="time [µs]", title="A tick")
    errors.set(xscale="log", xlabel="thrust error [N]", title="Distance to the exact thrusts")
    times.axvline(TICK_US, color="#999999", linewidth=0.8, linestyle=":")
    errors.axvline(SMALL_N, color="#999999", linewidth=0.8, linestyle=":")
    return figure


def draw_ticks(t: np.ndarray, limited: np.ndarray, results: Sequence[Result]) -> Figure:
    """Thrust error and iterations tick by tick; tinted where a limit is active."""
    figure = new_figure(3.8)
    errors, iterations = figure.subplots(2, 1, sharex=True)
    for index, one in enumerate(results):
        style = {"color": COLOURS[one.contender.family], "alpha": 0.5**index, "linewidth": 0.9}
        errors.plot(t, one.errors_n, label=one.contender.name, **style)
        iterations.plot(t, one.iterations, **style)
    for axes in (errors, iterations):
        shade(axes, t, limited, LIMITED)
    errors.set(yscale="log", ylabel="thrust error [N]", title="Tinted: active limit")
    iterations.set(ylabel="iterations", xlabel="time of the flight [s]")
    legend_below(figure)
    return figure
