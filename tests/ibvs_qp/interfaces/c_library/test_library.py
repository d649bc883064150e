"""The C library gives the thrusts of Python, in double to rounding and in float to milli-newtons."""

from __future__ import annotations

import ctypes
import dataclasses
import random
import subprocess
from typing import Any

import numpy as np
import pytest
from c_library import COMPILERS, instance, make, needs_compiler, pair, written
from controller_scenes import Wall, attitude, line_references, measured, random_tick
from recorded_inputs import recording

from allocation import DEFAULT_ROW_WEIGHTS, allocate_least_squares, control_effectiveness
from ibvs_qp.analytic import analytic_thrusts
from ibvs_qp.command import Outcome
from ibvs_qp.config import ControllerConfig, EstimationConfig
from ibvs_qp.config.errors import ConfigError
from ibvs_qp.controller import HybridController
from ibvs_qp.interfaces.c_library.library import write_library
from ibvs_qp.measurement import Reference
from tests.replay.cases import CASES

pytestmark = needs_compiler

CONFIG = ControllerConfig()
#: Largest difference on solved ticks [N], in double and in float: row filters carry the last thrusts on. The redundant
#: thrusts of eight rotors have a weight of 0.01 only.
DOUBLE_N, FLOAT_N, REDUNDANT_N, LOST_N = 5e-6, 0.1, 1e-3, 1e-4
#: The same after a tick that OSQP did not solve, in double, and in float with a lost rotor and otherwise [N]: the
#: analytic law flew that tick and the next ones, integrals differ from there on, and recorded inputs correct nothing.
#: With a rotor lost rounding grows in the integrals on solved ticks too: 0.07 N at the loss, 0.13 N after two seconds.
AFTER_OTHER_N, LOST_FLOAT_N, AFTER_OTHER_FLOAT_N = 5e-3, 0.2, 2.0
#: Outcome of a program that was solved on OSQP's active set.
REFINED = 5
FLIGHTS = [
    "paint_qp",
    "paint_paper_law",
    "press_beyond_reach",
    "rotor_loss",
    "heavy_noise",
    "paper_vision",
    "octorotor",
]


def differences(case: str, single: bool, **limits: float) -> tuple[np.ndarray, int]:
    """Differences of the thrusts on the ticks that OSQP solved [N], and how many were before the first other tick."""
    config, flight = CASES[case].config().controller, recording(case)
    config = dataclasses.replace(config, limits=dataclasses.replace(config.limits, **limits))
    python, own = pair(config, single)
    found, sound = [], -1
    for measurement, reference in zip(flight.measurements, flight.references, strict=True):
        command, other = python.step(measurement, reference), own.step(measurement, reference)
        if command.outcome is Outcome.SOLVED and other.outcome in ((0, 1, REFINED) if single else (0,)):
            found.append(np.abs(command.thrusts - np.array(other.thrusts)).max())
        elif sound < 0:
            sound = len(found)
    assert len(found) > 0.9 * len(flight.measurements)
    return np.array(found), len(found) if sound < 0 else sound


def test_a_recorded_flight_gives_the_thrusts_of_python() -> None:
    assert differences("press_beyond_reach", single=False)[0].max() <= DOUBLE_N


@pytest.mark.slow
def test_a_recorded_flight_in_single_precision_gives_the_thrusts_of_python() -> None:
    assert differences("press_beyond_reach", single=True)[0].max() <= FLOAT_N


@pytest.mark.slow
def test_a_vehicle_that_may_tilt_at_its_limits_has_the_thrusts_of_python() -> None:
    found, sound = differences("press_beyond_reach", single=False, trim_deg=2.0)
    assert found[:sound].max() <= DOUBLE_N and found.max() <= AFTER_OTHER_N


@pytest.mark.slow
@pytest.mark.parametrize("case", FLIGHTS)
def test_seven_flights_give_the_thrusts_of_python(case: str) -> None:
    """After a tick that OSQP did not solve, last thrusts differ: Python has DAQP there, the library an active set."""
    found, sound = differences(case, single=False)
    assert sound > 100
    assert found[:sound].max() <= {"octorotor": REDUNDANT_N, "rotor_loss": LOST_N}.get(case, DOUBLE_N)
    assert found.max() <= AFTER_OTHER_N


@pytest.mark.slow
@pytest.mark.parametrize("case", [case for case in FLIGHTS if case != "octorotor"])
def test_six_flights_in_single_precision_give_the_thrusts_of_python(case: str) -> None:
    """In "heavy_noise" single precision does not solve one tick, the first with lines in view."""
    found, sound = differences(case, single=True)
    assert sound > 100 and found[:sound].max() <= (LOST_FLOAT_N if case == "rotor_loss" else FLOAT_N)
    assert sound == len(found) or found.max() <= (LOST_FLOAT_N if case == "rotor_loss" else AFTER_OTHER_FLOAT_N)


@pytest.mark.slow
def test_gains_change_at_run_time_and_bad_ones_are_refused() -> None:
    gains = dataclasses.replace(CONFIG.gains, attitude_kp=30.0, force_kfi=0.0, line_ki=0.0, velocity_ki=1.0)
    other, own = HybridController(dataclasses.replace(CONFIG, gains=gains)), instance(CONFIG)
    for field in dataclasses.fields(gains):
        setattr(own.gains, field.name, getattr(gains, field.name))
    rng = np.random.default_rng(1)
    for tick in range(50):
        measurement, reference = random_tick(rng, 2, tick)
        command = own.step(measurement, reference)
        np.testing.assert_allclose(command.thrusts, other.step(measurement, reference).thrusts, atol=DOUBLE_N)
        assert command.rejected == 0
        own.gains.attitude_kp = 30.0 if tick < 30 else (float("nan"), -1.0)[tick % 2]
        if tick >= 30:
            own.step(*random_tick(rng, 2, tick))
            assert own.command.rejected & (1 << 15)
            break


def test_the_analytic_law_of_the_fallback_is_that_of_python() -> None:
    python, own = pair(CONFIG)
    rng, thrusts = np.random.default_rng(2), (ctypes.c_double * 6)()
    for tick in range(100):
        inputs = random_tick(rng, tick % 3, tick)
        python.step(*inputs)
        own.step(*inputs)
        own._library.ibvs_analytic_thrusts(own._instance, thrusts)
        np.testing.assert_allclose(np.array(thrusts), analytic_thrusts(python.setpoints), atol=1e-6)


def test_the_allocation_of_the_fallback_is_the_nearest_wrench() -> None:
    own, rng = instance(CONFIG), np.random.default_rng(3)
    matrix, weights = control_effectiveness(CONFIG.vehicle.geometry), np.array(DEFAULT_ROW_WEIGHTS)
    for _ in range(200):
        free, lower = rng.uniform(-20.0, 60.0, 6), rng.uniform(0.0, 10.0, 6)
        upper = lower + rng.uniform(0.01, 30.0, 6)
        found = (ctypes.c_double * 6)()
        given = ((ctypes.c_double * 6)(*values) for values in (free, lower, upper))
        own._library.ibvs_allocate(own._instance, *given, found)
        best = allocate_least_squares(matrix @ free, matrix, lower, upper)
        costs = [np.linalg.norm(weights * (matrix @ (np.array(u) - free))) for u in (found, best)]
        assert (lower <= np.array(found)).all() and (np.array(found) <= upper).all()
        assert costs[0] <= costs[1] + 1e-3


def test_stamps_that_leap_stop_or_go_back_are_followed_as_in_python() -> None:
    """A calm flight: on limited ticks OSQP stops within its tolerance, which earlier rounding decides."""
    choices = random.Random(4)
    python, own = pair(CONFIG)
    wall, stamp, rng = Wall(attitude(), 0.3), 0, np.random.default_rng(4)
    reference = Reference(lines=line_references(2), standoff=0.3)
    for tick in range(600):
        step = choices.choice([4_000_000] * 12 + [0, -2_000_000_000, 5_000_000_000, 40_000_000, 2**61])
        stamp = max(stamp + step, 0) % (2**62 + 10**9)
        seen = {
            "velocity": rng.normal(0.0, 0.01, 3),
            "lines": (
                wall.line(rng.normal(0.05, 0.002), 0.5 * np.pi, "horizontal"),
                wall.line(rng.normal(-0.05, 0.002), 0.0, "vertical"),
            ),
        }
        stamps = {name: stamp for name in ("stamp_ns", "wrench_stamp_ns", "plane_stamp_ns")}
        measurement = measured(tick, **seen, **stamps)
        command, other = python.step(measurement, reference), own.step(measurement, reference)
        assert bool(other.rejected & 1) == any(said.startswith("stamp_ns") for said in command.rejected)
        np.testing.assert_allclose(np.array(other.thrusts), command.thrusts, atol=DOUBLE_N)


@pytest.mark.parametrize(
    ("changes", "bit"),
    [
        ({"attitude": np.array([2.0, 0.0, 0.0, 0.0])}, 1),
        ({"angular_velocity": np.full(3, 40.0)}, 2),
        ({"specific_force": np.full(3, np.nan)}, 3),
        ({"contact_wrench": np.full(6, np.inf)}, 4),
        ({"velocity": np.full(3, 30.0)}, 5),
        ({"acceleration_bias": np.full(3, 6.0)}, 6),
        ({"plane": (0.0, 0.0, 1.0, 0.0)}, 10),
        ({"thrust_min": np.full(6, 9.0), "thrust_max": np.full(6, 8.0)}, 13),
    ],
)
def test_a_refused_entry_is_named_and_replaced_as_in_python(changes: dict[str, Any], bit: int) -> None:
    python, own = pair(CONFIG)
    reference = Reference(lines=line_references(2))
    for tick in range(3):
        measurement = measured(tick, velocity=np.zeros(3), specific_force=np.array([0.0, 0.0, -9.81]))
        if tick == 1:
            measurement = dataclasses.replace(measurement, **changes)
        command, other = python.step(measurement, reference), own.step(measurement, reference)
        assert other.rejected == (1 << bit if tick == 1 else 0), bin(other.rejected)
        assert (command.rejected != ()) == (tick == 1)
        np.testing.assert_allclose(np.array(other.thrusts), command.thrusts, atol=DOUBLE_N)


@pytest.mark.slow
def test_nothing_is_allocated_or_printed() -> None:
    folder = written(CONFIG, True, "", EstimationConfig())
    make(folder, "build/libibvs_qp.a", "CFLAGS=-O1")
    names = subprocess.run(["nm", "-u", "build/libibvs_qp.a"], cwd=folder, capture_output=True, text=True, check=True)
    wanted = {line.split()[-1] for line in names.stdout.splitlines() if line.startswith(" ")}
    assert not wanted & {"malloc", "calloc", "realloc", "free", "printf", "puts", "fopen", "clock_gettime"}
    assert not wanted & {"sin", "cos", "exp", "sqrt", "fmax", "fmin", "atan2", "pow"}, "single precision throughout"
    data = subprocess.run(["size", "-t", "build/libibvs_qp.a"], cwd=folder, capture_output=True, text=True, check=True)
    assert int(data.stdout.splitlines()[-1].split()[2]) == 0, "no global variables"


@pytest.mark.slow
@pytest.mark.parametrize("compiler", COMPILERS)
@pytest.mark.parametrize("single", [False, True])
def test_the_tests_of_the_library_pass_under_sanitizers(compiler: str, single: bool) -> None:
    """With estimation: the recorded flight, and 100,000 ticks with broken inputs, of the controller and of both."""
    config = CASES["press_beyond_reach"].config()
    folder = written(config.controller, single, "press_beyond_reach", config.estimation)
    sanitized = "CFLAGS=-O1 -g0 -fsanitize=address,undefined -fno-sanitize-recover=all"
    said = make(folder, f"BUILD=build_{compiler}", f"CC={compiler}", sanitized, "test", "COUNT=100000")
    assert said.count("passed") == 4


def test_single_precision_of_a_redundant_vehicle_is_refused(tmp_path: Any) -> None:
    with pytest.raises(ConfigError, match="8 rotors"):
        write_library(tmp_path, CASES["octorotor"].config().controller, single=True)


def test_what_the_library_has_not_is_refused_by_name(tmp_path: Any) -> None:
    with pytest.raises(ConfigError, match="thrust_rows"):
        write_library(tmp_path, dataclasses.replace(CONFIG, thrust_rows=False))
