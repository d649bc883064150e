"""OSQP against DAQP on recorded flights: thrusts, active limits, optimality, iterations."""

from __future__ import annotations

import numpy as np
import pytest
from solver_checks import FREE_N, LIMITED_N, check_active, exact, stationarity

from ibvs_qp.command import Command, Outcome
from ibvs_qp.controller import HybridController
from ibvs_qp.qp.solver import ACTIVE_MULTIPLIER, AcceptedSolution
from replay.broken import broken
from replay.cases import CASES, DATA
from replay.recordings import load

FLOWN = [name for name, case in CASES.items() if case.config().law == "qp"]
#: Every so many ticks are solved by DAQP too.
CHECKED = 3


@pytest.mark.slow
@pytest.mark.parametrize("name", FLOWN)
def test_osqp_solves_every_recorded_tick_like_daqp(name: str) -> None:
    controller, case = CASES[name].controller(), CASES[name]
    assert isinstance(controller, HybridController)
    recording = load(DATA / f"{case.inputs_of or name}.inputs.npz")
    if case.inputs_of is not None:
        recording = broken(recording)
    solutions: list[AcceptedSolution | None] = []
    solve = controller.engine.solve

    def remembered() -> AcceptedSolution | None:
        solutions.append(solve())
        return solutions[-1]

    controller.engine.solve = remembered  # type: ignore[method-assign]
    free, limited, solved = [], [], []
    for tick, (measurement, reference) in enumerate(zip(recording.measurements, recording.references, strict=True)):
        solutions.clear()
        command: Command = controller.step(measurement, reference)
        if command.outcome is Outcome.HOLD:
            continue
        (solution,) = solutions
        assert solution is not None and command.iterations > 0
        solved.append(command.outcome is Outcome.SOLVED)
        if tick % CHECKED:
            continue
        x, y = exact(controller)
        off = float(np.abs(command.thrusts - x[: len(command.thrusts)]).max())
        (limited if np.abs(y).max() > ACTIVE_MULTIPLIER else free).append(off)
        check_active({limit.name for limit in command.active_limits}, controller, y)
        assert stationarity(controller.engine.data, solution) < FREE_N
    at_limits = max(limited, default=0.0)
    print(f"{name}: OSQP - DAQP {max(free):.1e} N free, {at_limits:.1e} N limited, {np.mean(solved):.1%} solved")
    assert max(free) < FREE_N and at_limits < LIMITED_N
    assert np.mean(solved) >= 0.9
