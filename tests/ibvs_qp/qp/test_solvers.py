"""Solvers of `solver.name`: thrusts of the exact solution, acceptance by residuals, refusals, one more in one file."""

from __future__ import annotations

import os
import select
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from controller_scenes import line_references, measured, pack, random_tick
from recorded_inputs import recording
from small_vehicle import SmallVehicle
from solver_checks import LIMITED_N, check_active, exact

import ibvs_qp
from ibvs_qp.command import Outcome
from ibvs_qp.config import ControllerConfig, SolverSettings
from ibvs_qp.config.errors import ConfigError
from ibvs_qp.config.solver import SOLVERS
from ibvs_qp.controller import HybridController
from ibvs_qp.measurement import Reference
from ibvs_qp.qp.accept import QpEngine
from ibvs_qp.qp.solver import ACTIVE_MULTIPLIER, Solution, Solver
from tests.replay.cases import CASES

#: Largest difference of a thrust to the exact solution [N].
CLOSE_N = 1e-4


def config(name: str) -> ControllerConfig:
    """A configuration with a solver; skips the test where its library is not installed."""
    found = replace(ControllerConfig(), solver=SolverSettings(name=name))
    try:
        HybridController(found)
    except ConfigError:
        pytest.skip(f"{name} is not installed: the extra solvers")
    return found


@pytest.mark.parametrize("name", SOLVERS)
def test_recorded_ticks_have_the_thrusts_of_the_exact_solution(name: str) -> None:
    """The same programs for all: those of the shipped controller, every limited one and some of the others."""
    config(name)
    flight = recording("press_beyond_reach")
    controller = HybridController(CASES["press_beyond_reach"].config().controller)
    data = controller.engine.data
    engine, limited = QpEngine(controller.problem, SolverSettings(name=name), data), 0
    for tick, (measurement, reference) in enumerate(zip(flight.measurements, flight.references, strict=True)):
        command = controller.step(measurement, reference)
        if command.outcome is Outcome.HOLD or (tick % 10 and not command.active_limits):
            continue
        found, exact = engine.solve(), controller.engine.exact.solve(data.p, data.q, data.a, data.lower, data.upper)
        assert found is not None and exact is not None
        assert found.outcome is Outcome.SOLVED
        np.testing.assert_allclose(found.thrusts, exact.x[:6], atol=CLOSE_N)
        assert found.limited == bool(command.active_limits)
        limited += found.limited
    assert limited > 20


@pytest.mark.slow
@pytest.mark.parametrize("name", SOLVERS)
def test_a_flight_is_that_of_osqp(name: str) -> None:
    flights = []
    for each in (config(name), ControllerConfig()):
        controller, vehicle = HybridController(each), SmallVehicle(each, distance=0.02)
        for tick in range(300):
            reference = Reference(
                push_force=5.0, contact=True, standoff=0.02, lines=line_references(2 if tick > 50 else 0, 0.6)
            )
            command = controller.step(vehicle.measure(), reference)
            assert command.outcome in (Outcome.SOLVED, Outcome.EXACT_FALLBACK)
            vehicle.fly(command.thrusts)
        flights.append((command.thrusts, vehicle.position))
        controller.reset()
        assert controller.step(measured(0), Reference()).outcome is Outcome.SOLVED
    np.testing.assert_allclose(flights[0][0], flights[1][0], atol=0.05)
    np.testing.assert_allclose(flights[0][1], flights[1][1], atol=1e-3)


@pytest.mark.parametrize("change", ["x", "y", "sign", "none", "away"])
def test_an_answer_with_residuals_is_replaced_by_the_exact_one(change: str) -> None:
    """The claim "solved" of a solver that does not test its residuals itself counts for nothing."""

    class Wrong(Solver):
        def _solve(self, values: object, initial: object) -> Solution:
            return replaced

    weak = np.full(6, 50.0)
    weak[2] = 8.0
    controller = HybridController()
    for tick in range(5):
        expected = controller.step(measured(tick, thrust_max=weak), Reference())
    data, engine = controller.engine.data, controller.engine
    exact = engine.exact.solve(data.p, data.q, data.a, data.lower, data.upper)
    assert exact is not None and expected.active_limits
    far = np.where(np.arange(len(exact.y)) == 6, 1.0, exact.y)
    replaced = {
        "x": exact._replace(x=exact.x + 0.01),
        "y": exact._replace(y=1.5 * exact.y),
        "sign": exact._replace(y=-exact.y),
        "none": exact._replace(status=None),
        # stationary and feasible, but the multiplier of a row away from its bound is not zero
        "away": exact._replace(y=far, x=np.linalg.solve(data.hessian(), -data.q - data.rows().T @ far)),
    }[change]
    engine.solver = Wrong(controller.problem, engine.settings)
    found = engine.solve()
    assert found is not None and found.outcome is Outcome.EXACT_FALLBACK
    replaced = exact
    found = engine.solve()
    assert found is not None and found.outcome is Outcome.SOLVED


def test_what_cannot_solve_is_refused_by_name(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(ConfigError, match="name = 'gurobbi' is refused: allowed are clarabel, daqp, osqp"):
        SolverSettings(name="gurobbi")
    with pytest.raises(ConfigError, match="name = 'daqp' is refused: allowed with backend = 'compiled' is osqp"):
        SolverSettings(name="daqp", backend="compiled")
    monkeypatch.delitem(sys.modules, "ibvs_qp.qp.solvers.daqp", raising=False)
    monkeypatch.setitem(sys.modules, "daqp", None)
    with pytest.raises(ConfigError, match=r"solver.name = 'daqp' is refused: the library daqp is not installed"):
        HybridController(replace(ControllerConfig(), solver=SolverSettings(name="daqp")))


#: A back end of qpsolvers as a file of the folder of solvers.
ONE_FILE = """
import numpy as np
import qpsolvers
from scipy import sparse

from ibvs_qp.command import Outcome
from ibvs_qp.qp.solver import Solution, Solver


class Through(Solver):
    def _solve(self, values, initial):
        p, q, a, lower, upper = values
        rows, tight = self.dense.rows(a), {"eps_abs": 1e-9, "eps_rel": 0.0, "max_iter": 100_000}
        hessian, sides = sparse.csc_matrix(self.dense.hessian(p)), sparse.csc_matrix(np.vstack((rows, -rows)))
        problem = qpsolvers.Problem(hessian, q, sides, np.concatenate((upper, -lower)))
        found = qpsolvers.solve_problem(problem, solver="osqp", **tight)
        at_upper, at_lower = np.split(found.z, 2)
        return Solution(found.x, at_upper - at_lower, Outcome.SOLVED, 0)


SOLVER = Through
"""
_USE = """
import sys; sys.path.insert(0, sys.argv[1])
import numpy as np
from controller_scenes import measured
from ibvs_qp import ControllerConfig, HybridController, Reference
config = ControllerConfig.from_toml(sys.argv[2])
commands = [HybridController(each).step(measured(0), Reference()) for each in (config, ControllerConfig())]
assert commands[0].outcome == "solved", commands[0]
assert np.abs(commands[0].thrusts - commands[1].thrusts).max() < 1e-5
print(config.solver.name)
"""


def test_a_further_solver_is_one_file(tmp_path: Path) -> None:
    for package in ("ibvs_qp", "allocation"):
        shutil.copytree(Path(ibvs_qp.__file__).parents[1] / package, tmp_path / package)
    (tmp_path / "ibvs_qp" / "qp" / "solvers" / "through.py").write_text(ONE_FILE)
    (tmp_path / "preset.toml").write_text('[solver]\nname = "through"\n')
    support = str(Path(__file__).parents[2] / "support")
    command = [sys.executable, "-c", _USE, str(tmp_path), str(tmp_path / "preset.toml")]
    environment = {"PYTHONPATH": ":".join((support, *filter(None, sys.path))), "PATH": "/usr/bin:/bin"}
    done = subprocess.run(command, capture_output=True, text=True, env=environment, cwd=tmp_path)
    assert (done.returncode, done.stdout) == (0, "through\n"), done.stderr


@pytest.mark.parametrize("window", [(2.0, 30.0), (8.0, 13.0)])
def test_osqp_solves_programs_that_have_nothing_in_common_with_the_last_like_daqp(window: tuple[float, float]) -> None:
    controller, rng, worst = HybridController(), np.random.default_rng(5), 0.0
    for tick in range(200):
        pack(controller, *random_tick(rng, tick % 3, tick=tick), last=rng.uniform(2.0, 20.0, 6), window=window)
        solution = controller.engine.solve()
        x, y = exact(controller)
        assert solution is not None and solution.iterations > 0
        worst = max(worst, float(np.abs(solution.thrusts - x[:6]).max()))
        names = {controller.problem.row_names[row] for row in np.flatnonzero(np.abs(solution.y) > ACTIVE_MULTIPLIER)}
        check_active(names, controller, y)
        assert solution.limited == bool(names)
    print(f"window {window}: {worst:.1e} N")
    assert worst < LIMITED_N


_SOLVING = """
import os, signal, sys, numpy as np
from controller_scenes import pack, random_tick
from ibvs_qp.controller import HybridController
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background job ignores it
controller, caught = HybridController(), 0
pack(controller, *random_tick(np.random.default_rng(0), 2))
data, solver = controller.engine.data, controller.engine.solver
while caught < 4:
    try:
        print("solving", file=sys.stderr, flush=True)
        while True:
            data.q[:] = -data.q  # far from the last solution: nearly all the time is spent in OSQP
            solver.solve(data.p, data.q, data.a, data.lower, data.upper)
    except KeyboardInterrupt:
        caught += 1
os._exit(0)
"""


#: Signals that may be lost: one that arrives during the last iteration of a solve, after OSQP's last look at it. One
#: that was not answered for so long is lost [s].
LOST, PATIENCE_S = 3, 2.0
#: Until the process is in OSQP, where it spends 97 % of its time, on a loaded machine as well [s].
SOLVING_S = 0.1


def test_ctrl_c_during_a_solve_arrives() -> None:
    """OSQP 1.1 handles SIGINT itself while it solves: it prints "Solver interrupted" to stdout and drops the signal."""
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    command = [sys.executable, "-c", _SOLVING]
    process = subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, bufsize=0)
    assert process.stderr is not None
    try:
        assert process.stderr.readline() == b"solving\n"
        lost = 0
        while process.poll() is None and lost <= LOST:
            time.sleep(SOLVING_S)
            process.send_signal(signal.SIGINT)
            if select.select([process.stderr], [], [], PATIENCE_S)[0]:
                process.stderr.readline()
            else:
                lost += 1
        assert process.wait(timeout=10) == 0
    finally:
        process.kill()


_OVERLAPPING = """
import os, signal, threading, time, numpy as np
from controller_scenes import pack, random_tick
from ibvs_qp.controller import HybridController
signal.signal(signal.SIGINT, signal.default_int_handler)
def solve(controller):
    data, solver = controller.engine.data, controller.engine.solver
    for _ in range(300):
        data.q[:] = -data.q
        solver.solve(data.p, data.q, data.a, data.lower, data.upper)
controllers = [HybridController() for _ in range(2)]
for controller in controllers:
    pack(controller, *random_tick(np.random.default_rng(0), 2))
threads = [threading.Thread(target=solve, args=(each,)) for each in controllers]
for thread in threads:
    thread.start()
for thread in threads:
    thread.join()
try:
    os.kill(os.getpid(), signal.SIGINT)
    time.sleep(30.0)
except KeyboardInterrupt:
    os._exit(7)
"""


def test_ctrl_c_arrives_after_controllers_were_stepped_in_two_threads() -> None:
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    done = subprocess.run([sys.executable, "-c", _OVERLAPPING], env=environment, timeout=120, capture_output=True)
    assert done.returncode == 7, done.stderr.decode()
