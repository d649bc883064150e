"""Processor time of a control tick on recorded ticks of closed loops, and of the same programs in rival solvers."""

from __future__ import annotations

import contextlib
import gc
import importlib.util
import time
import warnings
from collections.abc import Callable

import numpy as np
import qpsolvers
from scipy import sparse

from ibvs_qp.config import ControllerConfig, SolverSettings
from ibvs_qp.config.errors import ConfigError
from ibvs_qp.config.solver import SOLVERS
from ibvs_qp.controller import HybridController
from ibvs_qp.qp.exact import ExactSolver
from ibvs_qp.qp.problem import ProgramData, QpProblem
from ibvs_qp.qp.solver import ProgramValues, Solver, make_solver
from ibvs_qp.symbolic.machine_code import compiler
from sim.bench.ticks import Tick, by_flight, recorded_ticks
from sim.bench.timing import Bench, Row

#: Joints of the arm: as many columns as the controller's program has thrusts and slacks.
JOINTS = 12
#: Length of a link [m], control period [s] and joint speed limit [rad/s].
LINK_M, TICK_S, SPEED_RAD_S = 0.15, 0.004, 3.0
#: Circle that the hand follows: radius [m] and turns per tick.
CIRCLE_M, TURNS_PER_TICK = 0.25, 1.0 / 500.0


def mink_row(ticks: int) -> Row | None:
    """Times of `mink.solve_ik` with a hand task, a posture task and joint speed limits; None without mink."""
    if importlib.util.find_spec("mink") is None:
        return None
    import mink  # pyright: ignore[reportMissingImports] -- from the extra "solvers"
    import mujoco

    model = mujoco.MjModel.from_xml_string(_arm())  # type: ignore[attr-defined, reportAttributeAccessIssue]
    configuration = mink.Configuration(model)
    configuration.update(np.full(JOINTS, 0.2))
    hand = mink.FrameTask("hand", "site", position_cost=1.0, orientation_cost=0.2, lm_damping=1e-6)
    posture = mink.PostureTask(model, cost=1e-3)
    posture.set_target(np.full(JOINTS, 0.2))
    speeds = {f"joint_{i}": SPEED_RAD_S for i in range(JOINTS)}
    limits = [mink.ConfigurationLimit(model), mink.VelocityLimit(model, speeds)]
    start, row = configuration.get_transform_frame_to_world("hand", "site"), Row(name="mink_12_joints")
    for tick in range(ticks):
        angle = 2.0 * np.pi * tick * TURNS_PER_TICK
        offset = CIRCLE_M * np.array([0.0, np.cos(angle) - 1.0, np.sin(angle)])
        hand.set_target(mink.SE3.from_rotation_and_translation(start.rotation(), start.translation() + offset))
        speed = row.measure(
            lambda: mink.solve_ik(configuration, [hand, posture], TICK_S, "daqp", damping=1e-6, limits=limits)
        )
        configuration.integrate_inplace(speed, TICK_S)
    return row


def _arm() -> str:
    """A chain of links whose joint axes alternate between z and y."""
    head, tail = "", ""
    for i in range(JOINTS):
        axis = "0 1 0" if i % 2 else "0 0 1"
        head += (
            f'<body pos="{LINK_M if i else 0} 0 0"><joint name="joint_{i}" axis="{axis}" range="-2.5 2.5"/>'
            f'<geom type="capsule" size="0.02" fromto="0 0 0 {LINK_M} 0 0"/>'
        )
        tail += "</body>"
    site = f'<site name="hand" pos="{LINK_M} 0 0"/>'
    return f'<mujoco><compiler angle="radian"/><worldbody>{head}{site}{tail}</worldbody></mujoco>'


#: Stages of a tick, in their order.
STAGES = ("pack", "evaluate", "solve", "explain")


def stage_medians(config: ControllerConfig, ticks: list[Tick]) -> dict[str, float]:
    """Median time of every stage of a step [us]; it includes the time of the measurement itself."""
    controller = HybridController(config)
    engine, step, times = controller.engine, controller.setpoints.step, []
    evaluate, solve = step.evaluate, engine.solve

    def timed_evaluate() -> None:
        marks.append(time.perf_counter_ns())
        evaluate()
        marks.append(time.perf_counter_ns())

    def timed_solve():
        found = solve()
        marks.append(time.perf_counter_ns())
        return found

    step.evaluate = timed_evaluate
    engine.solve = timed_solve  # type: ignore[method-assign]
    for measurement, reference in by_flight(controller, ticks):
        marks = [time.perf_counter_ns()]
        controller.step(measurement, reference)
        marks.append(time.perf_counter_ns())
        if len(marks) == len(STAGES) + 1:  # not a hover
            times.append(np.diff(marks))
    return dict(zip(STAGES, (1e-3 * np.median(times, axis=0)).tolist(), strict=True))


#: Ticks that warm a controller up before the measurement.
WARM_UP = 500
#: Back ends of qpsolvers that take dense matrices only.
DENSE = ("daqp", "quadprog")
#: Timed part of a row of each kind.
TIMED = {
    "step": "the whole tick, whose stage solve compares with the direct rows",
    "qpsolvers_NAME": "through qpsolvers: assembly of the program with scipy.sparse, then the solver",
    "qpsolvers_assembly": "that assembly alone, for the solvers that take sparse matrices",
    "direct_NAME": "the solver of solver.name on the values of the tick, warm where its library has workspaces",
    "casadi_daqp": "DAQP through CasADi with its conversions, as in the exact fallback",
}


def bench_qp(count: int, seed: int, sample: int, progress: Callable[[str], None]) -> Bench:
    """Measure the controller's step and its rivals.

    Args:
        count: Recorded ticks that the shipped controller steps through.
        seed: Of the recorded flights.
        sample: Rivals solve every n-th tick, as stated in the result.
        progress: Called with the name of the next measurement.

    Returns:
        Rows, stages, ratios, and notes: iterations, fraction of ticks on which OSQP iterates, outcomes, and thrust
        differences to the exact solver on all, limited and unlimited ticks.
    """
    progress(f"{count} ticks of closed loops")
    ticks = recorded_ticks(count, seed)
    few = ticks[: max(len(ticks) // 5, WARM_UP)]
    progress("the controller's step")
    config = ControllerConfig()
    compiled = config.on_backend("compiled")
    step, iterations, outcomes = _steps(HybridController(compiled), ticks, "step")
    progress("the step in Python")
    interpreted, _, _ = _steps(HybridController(config), few, "step_interpreted")
    progress("rivals")
    rivals, differences = _rivals(HybridController(config), ticks, sample)
    reference = mink_row(max(len(ticks) // sample, 1))
    rows = [interpreted, *rivals, *([] if reference is None else [reference])]
    notes = {
        "ticks": len(ticks),
        "compiler": " ".join(compiler() or ("none",)),
        "row_kinds": TIMED,
        "rivals_see_every": sample,
        "iterations": _histogram(iterations),
        "osqp_iterates_share": sum(count > 0 for count in iterations) / len(iterations),
        "outcomes": outcomes,
        "difference_to_exact_n": differences.pop("step", {}),
        "difference_to_exact_limited_n": differences.pop("step_limited", {}),
        "difference_to_exact_unlimited_n": differences.pop("step_unlimited", {}),
        "rivals_difference_to_exact_n": differences,
    }
    ratios = {row.name: row.median_us / step.median_us for row in rows if row.times_us}
    return Bench(rows=[step, *rows], stages_us=stage_medians(compiled, few), ratios=ratios, notes=notes)


def _steps(controller: HybridController, ticks: list[Tick], name: str) -> tuple[Row, list[int], dict[str, int]]:
    row, iterations, outcomes = Row(name=name), [], {}
    for measurement, reference in ticks[:WARM_UP]:
        controller.step(measurement, reference)
    controller.reset()
    gc.collect()
    for measurement, reference in by_flight(controller, ticks):
        command = row.measure(lambda: controller.step(measurement, reference))  # noqa: B023 - called at once
        iterations.append(command.iterations)
        outcomes[str(command.outcome)] = outcomes.get(str(command.outcome), 0) + 1
    return row, iterations, outcomes


def _rivals(
    controller: HybridController, ticks: list[Tick], sample: int
) -> tuple[list[Row], dict[str, dict[str, float]]]:
    """Times of the rivals on the controller's own programs, and thrust differences to the exact solver [N]."""
    problem, data = controller.problem, controller.engine.data
    rows = {name: Row(name=f"qpsolvers_{name}") for name in SOLVERS if name in qpsolvers.available_solvers}
    exact_row, exact = Row(name="casadi_daqp"), ExactSolver(problem)
    assembly_row, direct = Row(name="qpsolvers_assembly"), _direct_solvers(problem)
    direct_rows = {name: Row(name=f"direct_{name}") for name in direct}
    differences: dict[str, list[float]] = {}
    for index, (measurement, reference) in enumerate(by_flight(controller, ticks)):
        command = controller.step(measurement, reference)
        if index % sample or index < WARM_UP:
            continue
        found = exact_row.measure(lambda: exact.solve(data.p, data.q, data.a, data.lower, data.upper))
        part = "step_limited" if command.active_limits else "step_unlimited"
        answers = {"step": command.thrusts, part: command.thrusts}
        for name, row in rows.items():
            answer = row.measure(lambda: _through_qpsolvers(problem, data, name))  # noqa: B023 - called at once
            if answer is not None:
                answers[name] = answer[: len(command.thrusts)]
        assembly_row.measure(lambda: qpsolvers_problem(problem, data))
        for name, row in direct_rows.items():
            solver, initial = direct[name], None if command.active_limits else data.unlimited
            answer = row.measure(lambda: solver.solve(data.p, data.q, data.a, data.lower, data.upper, initial))  # noqa: B023 - called at once
            if answer is not None:
                answers[row.name] = answer.x[: len(command.thrusts)]
        if found is None:
            continue
        for name, thrusts in answers.items():
            differences.setdefault(name, []).append(float(np.abs(found[0][: len(thrusts)] - thrusts).max()))
    figures = {
        name: {"p99": float(np.percentile(errors, 99.0)), "max": max(errors)}
        for name, errors in differences.items()
        if errors
    }
    return [*rows.values(), assembly_row, *direct_rows.values(), exact_row], figures


def _direct_solvers(problem: QpProblem) -> dict[str, Solver]:
    """Solvers of `solver.name` whose libraries are installed."""
    found = {}
    for name in SOLVERS:
        with contextlib.suppress(ConfigError):
            found[name] = make_solver(problem, SolverSettings(name=name))
    return found


def qpsolvers_problem(problem: QpProblem, data: ProgramData | ProgramValues, dense: bool = False) -> qpsolvers.Problem:
    """One tick's program in the form of qpsolvers: full P, two-sided rows stacked as G x <= h."""
    upper_triangle, rows = problem.p_pattern.copy(), problem.a_pattern.copy()
    upper_triangle.data, rows.data = data.p.copy(), data.a.copy()
    hessian = sparse.csc_matrix(upper_triangle + sparse.triu(upper_triangle, 1).T)
    stacked = sparse.csc_matrix(sparse.vstack((rows, -rows)))
    bounds = np.concatenate((data.upper, -data.lower))
    if dense:
        return qpsolvers.Problem(hessian.toarray(), data.q.copy(), stacked.toarray(), bounds)
    return qpsolvers.Problem(hessian, data.q.copy(), stacked, bounds)


def _through_qpsolvers(problem: QpProblem, data: ProgramData, name: str) -> np.ndarray | None:
    """Solution of one tick's program by a back end of qpsolvers, (variables,); None if it found none."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # some warn that a sparse matrix is made dense
        return qpsolvers.solve_problem(qpsolvers_problem(problem, data, name in DENSE), solver=name).x


def _histogram(iterations: list[int]) -> dict[str, int]:
    """Number of ticks by number of iterations."""
    values, counts = np.unique(iterations, return_counts=True)
    return {str(int(value)): int(number) for value, number in zip(values, counts, strict=True)}
