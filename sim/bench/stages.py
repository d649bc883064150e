"""Time of every stage of a tick: check and pack, evaluate the equations, solve the program, explain."""

from __future__ import annotations

import time

import numpy as np

from ibvs_qp.config import ControllerConfig
from ibvs_qp.controller import HybridController
from sim.bench.ticks import Tick, by_flight

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
