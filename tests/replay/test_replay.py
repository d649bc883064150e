"""Recorded flights through pilot and controller, open loop: thrusts, programs, results, refusals; OSQP against DAQP."""

from __future__ import annotations

import numpy as np
import pytest
from solver_checks import FREE_N, LIMITED_N, check_active, exact, stationarity

from ibvs_qp.command import Command, Outcome
from ibvs_qp.controller import HybridController
from ibvs_qp.qp.solver import ACTIVE_MULTIPLIER, AcceptedSolution
from replay.broken import broken
from replay.cases import CASES, DATA
from replay.compare import compare, reference_outputs, report
from replay.recordings import load
from replay.replayer import replay
from replay.tolerances import TOLERANCES, Tolerance, tolerances_of


@pytest.mark.parametrize("name", CASES)
def test_replays_as_recorded(name: str) -> None:
    differences = compare(reference_outputs(name), replay(name), tolerances_of(name))
    over = [entry for entry in differences if entry.first_over is not None]
    if over:
        pytest.fail(f"{name}\n{report(over)}", pytrace=False)


def test_the_cases_cover_every_phase() -> None:
    seen: set[str] = set()
    for name, case in CASES.items():
        outputs = reference_outputs(name)
        seen |= {f"{route} {mode}" for route in ("pilot", "controller") for mode in outputs[f"{route}.mode"]}
        seen |= {f"{route} limited" for route in ("pilot", "controller") if outputs[f"{route}.active_limits"].any()}
        if case.inputs_of is None:
            recording = load(DATA / f"{name}.inputs.npz")
            seen |= {
                f"{name} slides" for wanted in recording.references if wanted.contact and wanted.velocity[0] < -0.05
            }
            seen |= {
                f"{name} lost" for limits in recording.thrust_limits if limits is not None and min(limits[1]) <= 0.0
            }
    modes = {f"{route} {mode}" for route in ("pilot", "controller") for mode in ("free", "approach", "contact")}
    slides = {f"{name} slides" for name in ("paint_qp", "paint_paper_law", "heavy_noise", "octorotor")}
    assert seen >= modes | slides | {"pilot limited", "controller limited", "controller hold", "rotor_loss lost"}


def test_a_difference_is_found() -> None:
    """In the right quantity, at the right tick, by the bound of that tick."""
    reference = reference_outputs("press_beyond_reach")
    limited = np.flatnonzero(reference["pilot.active_limits"] != "")[0]
    changed = {name: values.copy() for name, values in reference.items()}
    changed["pilot.thrusts"][limited, 2] += 1e-3
    changed["controller.rejected"] = changed["controller.rejected"].astype("U20")
    changed["controller.rejected"][7] = "velocity: not sound"
    for bound, expected in (
        (5e-4, {"pilot.thrusts": limited, "controller.rejected": 7}),
        (2e-3, {"controller.rejected": 7}),
    ):
        tolerances = TOLERANCES | {"thrusts": Tolerance(free=1e-9, limited=bound)}
        found = {entry.quantity: entry.first_over for entry in compare(reference, changed, tolerances)}
        assert {quantity: tick for quantity, tick in found.items() if tick is not None} == expected


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
