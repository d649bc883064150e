"""What a control tick costs, and the same programs through rivals, on recorded ticks of real closed loops."""

from __future__ import annotations

import dataclasses
import gc
from collections.abc import Callable

import numpy as np

from ibvs_qp.config import ControllerConfig
from ibvs_qp.controller import HybridController
from ibvs_qp.model.shared_library import compiler
from ibvs_qp.qp.exact import ExactSolver
from ibvs_qp.qp.offline import installed_solvers, solve_offline
from sim.bench.stages import stage_medians
from sim.bench.ticks import Tick, recorded_ticks
from sim.bench.timing import Bench, Row
from sim.bench.yardstick import mink_row

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
        Rows, stages, ratios, and notes: iterations, fraction of ticks on which OSQP iterates, outcomes, and thrust
        differences to the exact solver on all, limited and unlimited ticks.
    """
    tell(f"{count} ticks of closed loops")
    ticks = recorded_ticks(count, seed)
    tell("the controller's step")
    config = dataclasses.replace(ControllerConfig(), machine_code=True)
    step, iterations, outcomes = _steps(HybridController(config), ticks, "step")
    few = ticks[: max(len(ticks) // 5, WARM_UP)]
    tell("the step without machine code")
    interpreted, _, _ = _steps(HybridController(), few, "step_interpreted")
    tell("rivals")
    rivals, differences = _rivals(ticks, sample)
    yardstick = mink_row(max(len(ticks) // sample, 1))
    if yardstick is not None:
        rivals.append(yardstick)
    stages = stage_medians(config, few)
    ratios = {row.name: row.median_us / step.median_us for row in (interpreted, *rivals) if row.times_us}
    notes = {
        "ticks": len(ticks),
        "compiler": " ".join(compiler() or ("none",)),
        "rivals_see_every": sample,
        "iterations": _histogram(iterations),
        "osqp_iterates_share": sum(count > 0 for count in iterations) / len(iterations),
        "outcomes": outcomes,
        "difference_to_exact_n": differences.pop("step", {}),
        "difference_to_exact_limited_n": differences.pop("step_limited", {}),
        "difference_to_exact_unlimited_n": differences.pop("step_unlimited", {}),
        "rivals_difference_to_exact_n": differences,
    }
    return Bench(rows=[step, interpreted, *rivals], stages_us=stages, ratios=ratios, notes=notes)


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


def _rivals(ticks: list[Tick], sample: int) -> tuple[list[Row], dict[str, dict[str, float]]]:
    """The same ticks packed by the same controller, the program solved by somebody else from scratch."""
    controller = HybridController()
    rows = {name: Row(name=f"qpsolvers_{name}") for name in RIVALS if name in installed_solvers()}
    exact_row, exact = Row(name="casadi_daqp"), ExactSolver(controller.template)
    data, template, last = controller.engine.data, controller.template, -1
    differences: dict[str, list[float]] = {name: [] for name in ("step", "step_limited", "step_unlimited", *rows)}
    for index, (measurement, reference) in enumerate(ticks):
        if measurement.stamp_ns <= last:
            controller.reset()
        last = measurement.stamp_ns
        command = controller.step(measurement, reference)
        if index % sample or index < WARM_UP:
            continue
        found = exact_row.measure(lambda: exact.solve(data.p, data.q, data.a, data.lower, data.upper))
        part = "step_limited" if command.active_limits else "step_unlimited"
        answers = {"step": command.thrusts, part: command.thrusts}
        for name, row in rows.items():
            answer = row.measure(lambda: solve_offline(template, data, name))  # noqa: B023 - called at once
            if answer is not None:
                answers[name] = answer[0][: len(command.thrusts)]
        if found is not None:
            for name, thrusts in answers.items():
                differences[name].append(float(np.abs(found[0][: len(thrusts)] - thrusts).max()))
    figures = {
        name: {"p99": float(np.percentile(errors, 99.0)), "max": max(errors)}
        for name, errors in differences.items()
        if errors
    }
    return [*rows.values(), exact_row], figures


def _histogram(iterations: list[int]) -> dict[str, int]:
    """How many ticks needed how many iterations."""
    values, counts = np.unique(iterations, return_counts=True)
    return {str(int(value)): int(number) for value, number in zip(values, counts, strict=True)}
