"""The compiled backend gives the commands of the Python backend to the bit; without a compiler that one flies."""

from __future__ import annotations

import logging
from typing import Any

import numpy as np
import pytest
from c_library import needs_compiler
from controller_scenes import measured, random_tick
from recorded_inputs import recording

from ibvs_qp.config import ControllerConfig
from ibvs_qp.config.errors import ConfigError
from ibvs_qp.controller import HybridController
from ibvs_qp.measurement import Reference
from ibvs_qp.qp.compiled import CompiledSolver
from ibvs_qp.symbolic import machine_code
from tests.replay.cases import CASES


@pytest.fixture(autouse=True)
def patient(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(machine_code, "PATIENCE_S", 300.0)  # on a busy machine


@needs_compiler
@pytest.mark.parametrize("case", ["paint_qp", "rotor_loss", "press_beyond_reach"])
def test_recorded_flights_are_the_same_to_the_bit(case: str) -> None:
    config, flight = CASES[case].config().controller, recording(case)
    python, own = HybridController(config), HybridController(config.on_backend("compiled"))
    assert isinstance(own.engine.solver, CompiledSolver)
    for measurement, reference in zip(flight.measurements, flight.references, strict=True):
        command, other = python.step(measurement, reference), own.step(measurement, reference)
        np.testing.assert_array_equal(other.thrusts, command.thrusts)
        assert (other.outcome, other.iterations, other.rejected) == (
            command.outcome,
            command.iterations,
            command.rejected,
        )
        assert other.active_limits == command.active_limits
        assert tuple(other.tasks) == tuple(command.tasks)


@needs_compiler
def test_data_that_is_no_program_reaches_neither_solver(monkeypatch: pytest.MonkeyPatch) -> None:
    controller = HybridController(ControllerConfig().on_backend("compiled"))
    rng = np.random.default_rng(0)
    first = controller.step(*random_tick(rng, 2, 0))
    evaluate = controller.setpoints.step.evaluate

    def broken() -> None:
        evaluate()
        controller.engine.data.q[0] = np.nan

    monkeypatch.setattr(controller.setpoints.step, "evaluate", broken)
    command = controller.step(*random_tick(rng, 2, 1))
    assert command.outcome == "analytic_fallback" and np.isfinite(command.thrusts).all()
    monkeypatch.setattr(controller.setpoints.step, "evaluate", evaluate)
    for tick in range(2, 40):
        command = controller.step(measured(tick), Reference())
    assert command.outcome == first.outcome == "solved"


@needs_compiler
def test_a_reset_controller_is_as_a_new_one() -> None:
    rng = np.random.default_rng(1)
    ticks: list[Any] = [random_tick(rng, 2, tick) for tick in range(50)]
    controller = HybridController(ControllerConfig().on_backend("compiled"))
    first = [controller.step(*tick).thrusts for tick in ticks]
    controller.reset()
    np.testing.assert_array_equal([controller.step(*tick).thrusts for tick in ticks], first)


def test_without_a_compiler_python_serves_and_one_line_says_so(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setenv("CC", "no-such-compiler")
    with caplog.at_level(logging.INFO):
        controller = HybridController(ControllerConfig().on_backend("compiled"))
    assert not isinstance(controller.engine.solver, CompiledSolver)
    said = [record.getMessage() for record in caplog.records if "OSQP" in record.getMessage()]
    assert said == ["no C compiler: OSQP runs in its Python extension"]
    assert controller.step(measured(0), Reference()).outcome == "solved"


def test_another_backend_is_refused_by_name() -> None:
    with pytest.raises(ConfigError, match="backend"):
        ControllerConfig().on_backend("gpu")
