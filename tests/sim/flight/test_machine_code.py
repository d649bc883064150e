"""The tick as machine code: the same bits, and the interpreted tick wherever a compiler or its code fails."""

from __future__ import annotations

import shutil
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from references import good_reference
from small_vehicle import SmallVehicle

from ibvs_qp.analytic import PaperController
from ibvs_qp.config import ControllerConfig
from ibvs_qp.controller import HybridController
from ibvs_qp.symbolic import machine_code as module
from ibvs_qp.symbolic.machine_code import machine_code

needs_compiler = pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler on this machine")


@pytest.fixture(autouse=True)
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("IBVS_QP_CACHE", str(tmp_path))
    monkeypatch.setattr(module, "PATIENCE_S", 300.0)  # on a busy machine
    monkeypatch.delenv("CC", raising=False)
    return tmp_path


def small() -> ca.Function:
    x = ca.SX.sym("x", 2)
    return ca.Function("small", [x], [ca.sin(x[0]) * x[1] + x[0] / 3.0])


@pytest.mark.slow
@needs_compiler
@pytest.mark.parametrize("law", [HybridController, PaperController])
def test_a_flight_on_machine_code_is_the_same_flight_to_the_bit(law: type, own_cache: Path) -> None:
    thrusts = []
    for compiled in (False, True):
        controller = law(ControllerConfig().on_backend("compiled" if compiled else "python"))
        vehicle = SmallVehicle(controller.config)
        for _ in range(300):
            command = controller.step(vehicle.measure(), good_reference())
            vehicle.fly(command.thrusts)
            thrusts.append(command.thrusts)
    np.testing.assert_array_equal(thrusts[:300], thrusts[300:])
    assert list(own_cache.glob("step-*.so"))


@needs_compiler
def test_it_is_translated_once(own_cache: Path) -> None:
    machine_code(small())
    (library,) = own_cache.glob("*.so")
    before = library.stat().st_mtime_ns
    found = machine_code(small())
    assert found.class_name() == "External" and library.stat().st_mtime_ns == before
    assert [entry.name for entry in own_cache.iterdir()] == [library.name]


def test_without_a_compiler_the_function_itself_serves(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CC", "no-such-compiler")
    function = small()
    assert machine_code(function) is function
    controller = HybridController(ControllerConfig().on_backend("compiled"))
    assert controller.step(SmallVehicle(controller.config).measure(), good_reference()).outcome == "solved"


@needs_compiler
def test_a_failing_compiler_and_no_cache_cost_speed_and_nothing_else(
    own_cache: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setenv("CC", "false")
    function = small()
    assert machine_code(function) is function and "interpreted" in caplog.text
    (own_cache / "file").write_text("")
    monkeypatch.delenv("CC")
    monkeypatch.setenv("IBVS_QP_CACHE", str(own_cache / "file"))
    assert machine_code(function) is function


@needs_compiler
def test_machine_code_with_other_numbers_is_not_flown(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    x = ca.SX.sym("x", 2)
    other = ca.Function("small", [x], [ca.sin(x[0]) * x[1] + x[0] / 3.0000001])
    library = module._library(other, ["cc"])
    monkeypatch.setattr(module, "_library", lambda function, command: library)
    function = small()
    assert machine_code(function) is function and "other numbers" in caplog.text
