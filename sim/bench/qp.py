"""What a control tick costs, and the same programs through rivals, on recorded ticks of real closed loops."""

from __future__ import annotations

import dataclasses
import gc
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import qpsolvers
from scipy import sparse

from ibvs_qp.config import ControllerConfig
from ibvs_qp.controller import HybridController
from ibvs_qp.machine_code import compiler
from ibvs_qp.qp.exact_solver import ExactSolver
from sim.bench.stages import stage_medians
from sim.bench.ticks import Tick, recorded_ticks
from sim.bench.timing import Bench, Row

#: Ticks that warm a controller up before it is measured.
WARM_UP = 500
#: Rivals of qpsolvers, as far as they are installed.
RIVALS = ("osqp", "daqp", "quadprog", "proxqp", "piqp", "clarabel")


def bench_qp(count: int, seed: int, sample: int, tell: Callable[[str], None]) -> Bench:
    """Measure the controller's step and its rivals.

    Args:
        count: Recorded ticks that the shipped controller steps through.
        seed: Of the flights recorded.
        sample: Rivals see every so many-th of them, as stated in the result.
        tell: Told what is going on.

    Returns:
        Rows, stages, ratios, and beside them iterations, outcomes and agreement with the exact solver.
    """
    tell(f"{count} ticks of closed loops")
    ticks = recorded_ticks(count, seed)
    tell("the controller's step")
    config = dataclasses.replace(ControllerConfig(), machine_code=True)
    step, iterations, outcomes = _steps(HybridController(config), ticks, "step")
    few = ticks[: max(len(ticks) // 5, WARM_UP)]
    tell("the step without machine code")
    interpreted, _, _ = _steps(HybridController(), few, "step_interpreted")
    tell("OSQP at every tick")
    asked = dataclasses.replace(config, solver=dataclasses.replace(config.solver, shortcut=False))
    every, every_iterations, _ = _steps(HybridController(asked), few, "step_osqp_every_tick")
    tell("rivals")
    rivals, differences = _rivals(ticks, sample)
    stages = stage_medians(asked, few)
    ratios = {row.name: row.median_us / step.median_us for row in (interpreted, every, *rivals) if row.times_us}
    notes = {
        "ticks": len(ticks),
        "compiler": " ".join(compiler() or ("none",)),
        "rivals_see_every": sample,
        "iterations": _histogram(iterations),
        "iterations_osqp_every_tick": _histogram(every_iterations),
        "outcomes": outcomes,
        "difference_to_exact_n": differences,
    }
    return Bench(rows=[step, interpreted, every, *rivals], stages_us=stages, ratios=ratios, notes=notes)


def _steps(controller: HybridController, ticks: list[Tick], name: str) -> tuple[Row, list[int], dict[str, int]]:
    row, iterations, outcomes, last = Row(name=name), [], {}, -1
    for measurement, reference in ticks[:WARM_UP]:
        controller.step(measurement, reference)
    controller.reset()
    gc.collect()
    for measurement, reference in ticks:
        if measurement.stamp_ns <= last:
            controller.reset()
        last = measurement.stamp_ns
        command = row.measure(lambda: controller.step(measurement, reference))  # noqa: B023 - called at once
        iterations.append(command.iterations)
        outcomes[str(command.outcome)] = outcomes.get(str(command.outcome), 0) + 1
    return row, iterations, outcomes


def _rivals(ticks: list[Tick], sample: int) -> tuple[list[Row], dict[str, float]]:
    """The same ticks packed by the same controller, the program solved by somebody else from scratch."""
    controller = HybridController()
    installed = [name for name in RIVALS if name in qpsolvers.available_solvers]
    rows = {name: Row(name=f"qpsolvers_{name}") for name in installed}
    exact_row, exact = Row(name="casadi_daqp"), ExactSolver(controller.template)
    data, template, last, difference = controller.engine.data, controller.template, -1, []
    p_full, a_full = template.p_pattern.copy(), template.a_pattern.copy()
    for index, (measurement, reference) in enumerate(ticks):
        if measurement.stamp_ns <= last:
            controller.reset()
        last = measurement.stamp_ns
        command = controller.step(measurement, reference)
        if index % sample or index < WARM_UP:
            continue
        p_full.data, a_full.data = data.p.copy(), data.a.copy()
        problem = _problem(p_full, a_full, data.q, data.lower, data.upper)
        for name, row in rows.items():
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                row.measure(lambda: qpsolvers.solve_problem(problem(), solver=name))  # noqa: B023 - called at once
        found = exact_row.measure(lambda: exact.solve(data.p, data.q, data.a, data.lower, data.upper))
        if found is not None:
            difference.append(float(np.abs(found[0][: len(command.thrusts)] - command.thrusts).max()))
    figures = {"p99": float(np.percentile(difference, 99.0)), "max": max(difference)} if difference else {}
    return [*rows.values(), exact_row], figures


def _problem(
    p: sparse.csc_matrix, a: sparse.csc_matrix, q: np.ndarray, lower: np.ndarray, upper: np.ndarray
) -> Callable[[], Any]:
    """Makes the problem as a user of qpsolvers would: full P, two-sided rows stacked."""

    def build() -> Any:
        full: Any = sparse.csc_matrix(p + sparse.triu(p, 1).T)
        stacked: Any = sparse.csc_matrix(sparse.vstack((a, -a)))
        return qpsolvers.Problem(full, q, stacked, np.concatenate((upper, -lower)))

    return build


def _histogram(iterations: list[int]) -> dict[str, int]:
    """How many ticks needed how many iterations."""
    values, counts = np.unique(iterations, return_counts=True)
    return {str(int(value)): int(number) for value, number in zip(values, counts, strict=True)}
