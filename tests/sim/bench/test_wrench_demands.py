"""Demands beyond reach: the program keeps height and level, gives up lateral force and says so."""

from __future__ import annotations

import json
import runpy
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

BENCHMARK = Path(__file__).parents[3] / "benchmarks" / "wrench_demands.py"


@pytest.fixture(scope="module")
def bench() -> dict:
    return runpy.run_path(str(BENCHMARK))


@pytest.fixture(scope="module")
def rows(bench: dict) -> dict:
    return bench["table"](4000)["rows"]


@pytest.mark.slow
def test_the_program_gives_up_lateral_force_alone(rows: dict) -> None:
    program = rows["program"]
    assert program["vertical_n"] <= 0.5
    assert program["roll_pitch_nm"] <= 0.05
    assert program["yaw_nm"] <= 0.05
    assert program["lateral_n"] > 10.0


def test_the_rivals_on_the_same_demands(rows: dict) -> None:
    for name in ("pseudo-inverse, clipped", "PX4 order, airmode off"):
        assert rows[name]["vertical_n"] == pytest.approx(18.3, abs=0.5)
        assert rows[name]["lateral_n"] == pytest.approx(10.4, abs=0.5)
    assert rows["PX4 order, airmode off"]["roll_pitch_nm"] > 2.5
    assert rows["PX4 order, airmode full"]["vertical_n"] > 50.0
    # Lateral first keeps height and level as well, at the price of more lateral force: it only knows one direction.
    sequential = rows["sequential, lateral first"]
    assert sequential["vertical_n"] < 0.01 and sequential["roll_pitch_nm"] < 0.01
    assert sequential["lateral_n"] > rows["box least squares"]["lateral_n"] + 1.0


def test_without_its_height_row_the_program_climbs(rows: dict) -> None:
    assert rows["program without height row"]["vertical_n"] > 2.0


def test_what_is_given_up_is_reported(bench: dict) -> None:
    program, effectiveness = bench["ProgramAllocation"](), bench["B"]
    for wrench in bench["demands"](300, seed=4):
        missing = wrench - effectiveness @ program(wrench)
        # The pull to the last thrusts, here far away, bends the free optimum where it is softest: along the push.
        np.testing.assert_allclose(program.unallocated, missing, rtol=0.02, atol=0.2)
    assert set(program.outcomes) <= {"solved", "inaccurate_accepted", "capped_accepted", "exact_fallback"}
    # Each demand is far from the last one, so that OSQP may reach its cap; DAQP solves those.
    assert program.outcomes["solved"] >= 0.95 * 300


def test_every_demand_is_beyond_reach_and_repeats(bench: dict) -> None:
    first, second = bench["demands"](50, seed=1), bench["demands"](50, seed=1)
    np.testing.assert_array_equal(first, second)
    thrusts = np.linalg.solve(bench["B"], first.T)
    assert ((thrusts < bench["LOWER"][:, None]) | (thrusts > bench["UPPER"][:, None])).any(axis=0).all()


def test_one_json_line() -> None:
    command = [sys.executable, str(BENCHMARK), "--count", "20", "--json"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, cwd=BENCHMARK.parents[1])
    result = json.loads(done.stdout)
    assert done.returncode == 0 and result["count"] == 20 and "program" in result["rows"]
