"""Time of every stage of a tick: pack, evaluate, update of OSQP's data, solve, unpack."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from ibvs_qp.config import ControllerConfig
from ibvs_qp.controller import HybridController
from sim.bench.ticks import Tick, by_flight
from sim.bench.timing import Stopwatch


class _TimedWorkspace:
    """OSQP's extension object, which has no writable attributes, with its calls timed."""

    def __init__(self, inner: Any, watch: Stopwatch) -> None:
        self._inner = inner
        self.update_data_vec = watch.around("update", inner.update_data_vec)
        self.update_data_mat = watch.around("update", inner.update_data_mat)
        self.solve = watch.around("solve", inner.solve)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._inner, name)


def stage_medians(config: ControllerConfig, ticks: list[Tick]) -> dict[str, float]:
    """Median time of every stage of a step [us]; it includes the time of the measurement itself."""
    controller, watch = HybridController(config), Stopwatch()
    engine, step = controller.engine, controller.setpoints.step
    step.evaluate = watch.around("evaluate", step.evaluate)
    engine.solve = watch.around("engine", engine.solve)  # type: ignore[method-assign]
    table: dict[str, list[float]] = {name: [] for name in ("pack", "evaluate", "update", "solve", "unpack")}
    for measurement, reference in by_flight(controller, ticks):
        inner = getattr(engine.osqp, "_inner", None)
        if inner is not None and not isinstance(inner, _TimedWorkspace):  # a reset makes a new workspace
            engine.osqp._inner = _TimedWorkspace(inner, watch)
        watch.spent = {}
        start = time.perf_counter_ns()
        controller.step(measurement, reference)
        total, spent = 1e-3 * (time.perf_counter_ns() - start), watch.spent
        if "solve" not in spent:  # the first solve of a workspace
            continue
        stages = {name: spent[name] for name in ("evaluate", "update", "solve")}
        stages["unpack"] = spent["engine"] - spent["update"] - spent["solve"]
        stages["pack"] = total - spent["engine"] - spent["evaluate"]
        for name, duration in stages.items():
            table[name].append(duration)
    return {name: float(np.median(times)) for name, times in table.items() if times}
