"""The sweep engine: resume, failures as rows, order, Ctrl-C, and the same table for one and for two processes."""

from __future__ import annotations

import dataclasses
import json
import math
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import polars as pl
import pytest
from synthetic_trace import Errors, synthetic_trace

import sim.sweep.flying
from ibvs_qp.config.errors import ConfigError
from sim.evaluate.measures import paint_figures, press_figures
from sim.experiments.scenes import changed, near_wall, short_job
from sim.flight.jobs import PressJob
from sim.flight.options import FlightOptions, pilot_config
from sim.flight.trace_log import load_trace
from sim.sweep import FlightPlan, Run, run_sweep
from sim.sweep.design import configuration_hash
from sim.sweep.statistics import cells, false_claims, paired_differences


def made_up(seed=0, law="qp", friction=0.3, **changes) -> Run:
    scene = changed(short_job(0.3), wall={"friction": friction})
    options = FlightOptions(law=law, seed=seed, features="geometric", video=False)
    plan = FlightPlan(scene=scene, config=pilot_config(scene, options), options=options)
    return Run(experiment="test", variant="standard", params={"friction": friction}, plan=plan, measure=paint_figures,
               **changes)  # fmt: skip


@pytest.fixture
def flown(monkeypatch):
    """Flights are made up; the list names the seeds flown."""
    seeds: list[int] = []

    def fly(scene, options, **_):
        seeds.append(options.seed)
        if options.seed == 13:
            raise ZeroDivisionError("thirteen")
        if options.seed == 14:
            raise ConfigError("refused by name")
        if options.seed == 99:
            trace = synthetic_trace(Errors(), scene, options.law, options.seed)
            trace.reason = "interrupted"
            return trace
        offsets = (0.0, -0.02) if options.seed == 15 else (0.002, 0.003)
        errors = Errors(push_error_n=0.01 * options.seed, row_offset_m=offsets)
        return synthetic_trace(errors, scene, options.law, options.seed)

    monkeypatch.setattr(sim.sweep.flying, "fly", fly)
    return seeds


def test_finished_parts_are_not_flown_again(flown, tmp_path):
    runs = [made_up(seed) for seed in range(4)]
    first = run_sweep(runs[:2], tmp_path)
    again = run_sweep(runs, tmp_path)
    assert flown == [0, 1, 2, 3]
    assert (first.reused, again.reused) == (0, 2)
    assert again.table["seed"].to_list() == [0, 1, 2, 3]
    assert first.table.equals(again.table[:2])


def test_a_changed_setting_is_flown_anew(flown, tmp_path):
    run_sweep([made_up(1)], tmp_path)
    table = run_sweep([made_up(1, friction=0.4)], tmp_path).table
    assert flown == [1, 1]
    assert table["param.friction"].to_list() == [0.4]
    assert (
        configuration_hash(made_up(1)) == configuration_hash(made_up(2)) != configuration_hash(made_up(1, law="paper"))
    )


def test_changed_flight_code_is_flown_anew(flown, tmp_path, monkeypatch):
    run_sweep([made_up(1)], tmp_path)
    monkeypatch.setattr("sim.sweep.design.code_hash", lambda: "other code")
    run_sweep([made_up(1)], tmp_path)
    assert flown == [1, 1]


def test_failed_runs_are_rows_with_a_reason(flown, tmp_path):
    table = run_sweep([made_up(12), made_up(13), made_up(14)], tmp_path).table
    assert table["completed"].to_list() == [True, False, False]
    assert "ZeroDivisionError: thirteen" in table["reason"][1]
    assert table["reason"][2] == "refused: refused by name"
    assert table["path_rms_straight_m"].is_null().to_list() == [False, True, True]


@pytest.mark.parametrize("block", [1, 2, 5])
def test_blocks_do_not_change_the_table(flown, tmp_path, block):
    runs = [made_up(seed, law) for law in ("qp", "paper") for seed in range(3)]
    table = run_sweep(runs, tmp_path, block_runs=block).table
    assert table.drop("log").equals(run_sweep(runs, tmp_path / "other").table.drop("log"))
    assert len(list(tmp_path.glob("part-*.parquet"))) == math.ceil(6 / block)


def test_interrupt_keeps_finished_parts_and_writes_no_half(flown, tmp_path):
    runs = [made_up(0), made_up(99), made_up(1)]
    result = run_sweep(runs, tmp_path)
    assert result.interrupted and result.table["seed"].to_list() == [0]
    assert flown == [0, 99]
    assert len(list(tmp_path.iterdir())) == 1


def test_rows_say_where_they_come_from(flown, tmp_path):
    row = run_sweep([made_up(5, keep=True)], tmp_path).table.to_dicts()[0]
    assert row["config_hash"] == configuration_hash(made_up(5))
    assert row["version"] and row["code_hash"]
    assert (tmp_path / row["log"] / "log.npz").is_file()


def test_a_false_claim_is_a_failed_flight_and_is_counted(flown, tmp_path):
    table = run_sweep([made_up(0), made_up(15)], tmp_path).table
    assert table["completed"].to_list() == [True, False] and table["claimed"].to_list() == [True, True]
    assert table["reason"][1] == "false claim: row 2: 20 mm from its place; overlaps row 1 by 28 mm, nominal 8.0 mm"
    assert [cell["false_claims"] for cell in cells(table)] == [1] and false_claims(table) == 1
    assert cells(table)[0]["completed"] == 1 and paired_differences(table) == []


def test_the_trace_of_every_flight_yields_its_figures_again(flown, tmp_path):
    table = run_sweep([made_up(seed, trace=True) for seed in range(2)], tmp_path).table
    for row in table.to_dicts():
        again = paint_figures(load_trace(tmp_path / row["trace"]))
        assert again["force_rms_n"] == pytest.approx(row["force_rms_n"], abs=1e-6)
        assert again["place_error_m"] == pytest.approx(row["place_error_m"], rel=1e-5)
    assert run_sweep([made_up(0)], tmp_path).table["trace"].to_list() == [None], "another run: it keeps no trace"


def real(seed: int) -> Run:
    scene = near_wall()
    options = FlightOptions(seed=seed, features="geometric", video=False)
    plan = FlightPlan(scene=scene, config=pilot_config(scene, options), options=options, job=PressJob(hold_s=1.0))
    return Run(experiment="test", variant="standard", params={}, plan=plan, measure=press_figures)


@pytest.mark.slow
def test_two_processes_give_the_same_table_to_the_bit(tmp_path):
    runs = [real(0), real(1)]
    alone, apart = (run_sweep(runs, tmp_path / str(count), workers=count).table for count in (1, 2))
    assert alone.equals(apart)
    assert alone["completed"].all() and alone["touched"].to_list() == [1.0, 1.0]


def test_parameters_of_all_kinds_share_a_table(flown, tmp_path):
    runs = [
        dataclasses.replace(made_up(0), params={"push": 5.0}),
        dataclasses.replace(made_up(1), params={"name": "left", "told": True}),
    ]
    table = run_sweep(runs, tmp_path).table
    assert table["param.push"].to_list() == [5.0, None]
    assert table["param.told"].to_list() == [None, True]
    assert table.schema["param.name"] == pl.String


def test_a_part_appears_whole_or_not_at_all(flown, tmp_path, monkeypatch):
    def half(self, file):
        file.write(b"PAR1 half of a fi")
        raise OSError("disk full")

    monkeypatch.setattr(pl.DataFrame, "write_parquet", half)
    with pytest.raises(OSError, match="disk full"):
        run_sweep([made_up(0)], tmp_path)
    monkeypatch.undo()
    assert not list(tmp_path.glob("part-*.parquet"))


_PROGRAM = """
import sys
import sim.commands.experiment
import dataclasses
import sim.experiments.design as experiments
approach = experiments.experiment("approach")
short = dataclasses.replace(approach, fixed={"job.hold_s": 0.5})
experiments.experiment = lambda name: short
from sim.commands.cli import main
sys.exit(main())
"""


def start(out: Path) -> subprocess.Popen[bytes]:
    words = ["experiment", "approach", "--features", "geometric", "--json", "--jobs", "2", "--out", str(out)]
    program = [sys.executable, "-c", _PROGRAM, *words]
    return subprocess.Popen(program, stdout=subprocess.PIPE, stderr=subprocess.PIPE, start_new_session=True)


@pytest.mark.slow
@pytest.mark.parametrize("group", [False, True], ids=["parent alone", "whole group, as a terminal does"])
def test_ctrl_c_keeps_finished_flights(tmp_path, group):
    process = start(tmp_path)
    while len(list(tmp_path.glob("parts/part-*.parquet"))) < 2 and process.poll() is None:
        time.sleep(0.2)
    (os.killpg if group else os.kill)(process.pid, signal.SIGINT)
    out, err = process.communicate(timeout=60)
    assert process.returncode == 130, err.decode()
    content = json.loads(out)
    parts = list(tmp_path.glob("parts/part-*.parquet"))
    assert content["interrupted"] is True
    assert sum(cell["n"] for cell in content["cells"]) == len(parts) >= 2
    assert b"Traceback" not in err and b"go on with" in err
    assert _gone(process.pid)


def _gone(session: int) -> bool:
    """Whether every process of the session ends within a few seconds."""
    for _ in range(100):
        alive = subprocess.run(["ps", "-o", "pid=", "-g", str(session)], capture_output=True, text=True).stdout.split()
        if not alive:
            return True
        time.sleep(0.2)
    return False
