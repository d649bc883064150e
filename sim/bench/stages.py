"""Where a tick's time goes: packing, evaluating, handing over, solving, judging and reporting."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from ibvs_qp.config import ControllerConfig
from ibvs_qp.controller import HybridController
from sim.bench.ticks import Tick


class _Clock:
    """Wraps calls and notes how long they took in a tick."""

    def __init__(self) -> None:
        self.spent: dict[str, float] = {}

    def around(self, stage: str, call: Any) -> Any:
        """The same call, timed."""

        def timed(*arguments: Any, **options: Any) -> Any:
            start = time.perf_counter_ns()
            result = call(*arguments, **options)
            self.spent[stage] = self.spent.get(stage, 0.0) + 1e-3 * (time.perf_counter_ns() - start)
            return result

        return timed


class _TimedWorkspace:
    """OSQP's extension object with a clock: handing data over is one stage, iterating another."""

    def __init__(self, inner: Any, clock: _Clock) -> None:
        self._inner = inner
        self.update_data_vec = clock.around("update", inner.update_data_vec)
        self.update_data_mat = clock.around("update", inner.update_data_mat)
        self.solve = clock.around("solve", inner.solve)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._inner, name)


def stage_medians(config: ControllerConfig, ticks: list[Tick]) -> dict[str, float]:
    """Median time of every stage of a step with OSQP at every tick [us]; the clocks' own time is in them."""
    controller, clock, last = HybridController(config), _Clock(), -1
    tick, solver = controller.setpoints.tick, controller.engine.osqp
    tick._evaluate = clock.around("evaluate", tick._evaluate)
    table: dict[str, list[float]] = {name: [] for name in ("pack", "evaluate", "update", "solve", "unpack")}
    engine = controller.engine.solve
    controller.engine.solve = clock.around("engine", engine)  # type: ignore[method-assign]
    setpoints = controller.setpoints.update
    controller.setpoints.update = clock.around("setpoints", setpoints)  # type: ignore[method-assign]
    for measurement, reference in ticks:
        if measurement.stamp_ns <= last:
            controller.reset()
        last = measurement.stamp_ns
        inner = getattr(solver, "_inner", None)
        if inner is not None and not isinstance(inner, _TimedWorkspace):
            solver._inner = _TimedWorkspace(inner, clock)
        clock.spent = {}
        start = time.perf_counter_ns()
        controller.step(measurement, reference)
        total, spent = 1e-3 * (time.perf_counter_ns() - start), clock.spent
        if "solve" not in spent:
            continue
        table["evaluate"].append(spent["evaluate"])
        table["update"].append(spent["update"])
        table["solve"].append(spent["solve"])
        table["unpack"].append(spent["engine"] - spent["update"] - spent["solve"])
        table["pack"].append(total - spent["engine"] - spent["evaluate"])
    return {name: float(np.median(times)) for name, times in table.items() if times}
