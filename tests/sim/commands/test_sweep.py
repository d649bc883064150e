"""``ibvs-qp sweep`` with made-up flights: contract, resume, interrupt, a kill, a cluster, the report, refusals."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import polars as pl
import pytest
from contract_schema import refusal

import sim.sweep.figures
import sim.sweep.flying
import sim.sweep.planned
from sim.commands.cli import main
from sim.sweep import Planned, load_spec, run_sweep
from sim.sweep.parts import write_table

SPEC = """
name = "made_up"
laws = ["qp", "paper"]
samples = 4
block_runs = 3
[grid]
scene.wall.friction = [0.2, 0.4, 0.6]
[random]
scene.plant.mass_kg = { low = 5.0, high = 7.0 }
"""
RUNS = 24


def made_up_flight(scene, options, **_):
    """A flight whose figures follow from scene and law; the slippery heavy ones fail."""
    weight = scene.wall.friction * scene.plant.mass_kg
    if scene.plant.mass_kg > 6.0 and scene.wall.friction > 0.5:
        raise ZeroDivisionError("too heavy")
    figures = {"path_rms_m": 1e-3 * weight, "force_rms_n": weight * (1.0 if options.law == "qp" else 1.5)}
    done, reason = weight < 2.3, "held" if weight < 2.3 else "lost"
    outcome = {"completed": done, "claimed": done, "reason": reason}
    return SimpleNamespace(outcome=outcome, reason=reason, figures=figures)


def made_up_figures(trace):
    return trace.figures


@pytest.fixture
def flown(monkeypatch, tmp_path):
    """Flights are made up and counted, reports are not drawn; the folder holds spec.toml."""
    flights: list[float] = []

    def fly(scene, options, **_):
        flights.append(scene.wall.friction)
        return made_up_flight(scene, options)

    monkeypatch.setattr(sim.sweep.flying, "fly", fly)
    monkeypatch.setattr(sim.sweep.flying, "outcome", lambda trace: trace.outcome)
    monkeypatch.setattr(sim.sweep.planned, "press_row", made_up_figures)
    monkeypatch.setattr(sim.sweep.figures, "write_report", lambda table, folder, *_: folder / "report.md")
    (tmp_path / "spec.toml").write_text(SPEC)
    monkeypatch.chdir(tmp_path)
    return flights


@pytest.fixture
def drawn(flown, monkeypatch):
    """Reports are drawn after all."""
    monkeypatch.setattr(sim.sweep.figures, "write_report", sim.sweep.figures.page.write_report)


def table_of(folder: str) -> pl.DataFrame:
    return pl.read_parquet(Path(folder) / "made_up.parquet")


def test_json_files_and_resume(flown, capsys):
    words = ["sweep", "spec.toml", "--jobs", "1", "--json", "--out", "run"]
    assert main(words) == 0 and len(flown) == RUNS
    assert main(words) == 0 and len(flown) == RUNS
    first, second = (json.loads(line) for line in capsys.readouterr().out.splitlines())
    assert (first["schema"], first["planned"], first["flights"], first["interrupted"]) == (1, RUNS, RUNS, False)
    assert (first["on_disk_before"], second["on_disk_before"]) == (0, RUNS)
    table = pl.read_parquet(first["data_file"])
    assert table.height == RUNS and len(list(Path("run/parts").glob("part-*.parquet"))) == 8
    assert table["seed"].null_count() == 0 and set(table["param.scene.wall.friction"]) == {0.2, 0.4, 0.6}
    assert first["completed"] == table["completed"].sum() < RUNS
    assert sum(first["failed"].values()) == RUNS - first["completed"]
    assert Path("run/spec.toml").read_text() == SPEC
    assert json.loads(Path("run/sweep.json").read_text()) == second


def test_ctrl_c_keeps_blocks_and_the_rest_is_flown_later(flown, monkeypatch, capsys):
    whole = sim.sweep.flying.fly

    def fly(*arguments, **named):
        if len(flown) == 10:
            raise KeyboardInterrupt
        return whole(*arguments, **named)

    monkeypatch.setattr(sim.sweep.flying, "fly", fly)
    monkeypatch.setattr(sim.sweep.flying, "outcome", lambda trace: trace.outcome)
    assert main(["sweep", "spec.toml", "--jobs", "1", "--json", "--out", "run"]) == 130
    out, err = capsys.readouterr()
    assert json.loads(out)["flights"] == 9 and err.count("\n") == 1 and "go on with: ibvs-qp sweep spec.toml" in err
    monkeypatch.setattr(sim.sweep.flying, "fly", whole)
    assert main(["sweep", "spec.toml", "--jobs", "1", "--json", "--out", "run"]) == 0
    assert len(flown) == 10 + RUNS - 9
    main(["sweep", "spec.toml", "--jobs", "1", "--json", "--out", "other"])
    assert table_of("run").equals(table_of("other"))


_KILLED = """
import os, signal, sys
from pathlib import Path
sys.path.insert(0, {tests!r})
import sim.sweep.figures, sim.sweep.flying, sim.sweep.planned, test_sweep as made_up
sim.sweep.planned.press_row = made_up.made_up_figures
sim.sweep.figures.write_report = lambda *_: None
def fly(*arguments, **named):
    if len(list(Path("run/parts").glob("part-*.parquet"))) >= 3:
        os.kill(os.getpid(), signal.SIGKILL)
    return made_up.made_up_flight(*arguments, **named)
sim.sweep.flying.fly = fly
sim.sweep.flying.outcome = lambda trace: trace.outcome
from sim.commands.cli import main
main(["sweep", "spec.toml", "--jobs", "1", "--json", "--out", "run"])
"""


@pytest.mark.slow
def test_killed_half_way_and_resumed_gives_the_same_table(flown):
    program = [sys.executable, "-c", _KILLED.format(tests=str(Path(__file__).parent))]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    process = subprocess.run(program, env=environment, check=False)
    assert process.returncode == -signal.SIGKILL and not Path("run/made_up.parquet").exists()
    left = len(list(Path("run/parts").glob("part-*.parquet")))
    assert 3 <= left < 8
    assert main(["sweep", "spec.toml", "--jobs", "1", "--json", "--out", "run"]) == 0
    assert len(flown) == RUNS - 3 * left
    main(["sweep", "spec.toml", "--jobs", "1", "--json", "--out", "whole"])
    assert table_of("run").equals(table_of("whole"))


@pytest.mark.slow
def test_a_dask_cluster_gives_the_same_table(flown, tmp_path):
    distributed = pytest.importorskip("distributed", reason="a Dask cluster needs the extra cluster")
    from sim.sweep.engine import dask_pool, require_usable

    design = Planned(load_spec(tmp_path / "spec.toml"))
    alone = run_sweep(design, tmp_path / "alone", block_runs=3).table
    settings = {"processes": False, "n_workers": 2, "threads_per_worker": 1, "dashboard_address": None}
    with distributed.LocalCluster(**settings) as cluster, distributed.Client(cluster) as client:
        require_usable(client)
        apart = run_sweep(design, tmp_path / "apart", block_runs=3, pool=dask_pool(client))
    assert apart.table.equals(alone) and apart.table["reason"].str.contains("too heavy").any()
    assert len(flown) == 2 * RUNS


def test_clusters_that_cannot_fly_are_refused_by_name(flown, monkeypatch, capsys):
    distributed = pytest.importorskip("distributed", reason="a Dask cluster needs the extra cluster")
    import sim.sweep.engine

    monkeypatch.setattr(sim.sweep.engine, "CONNECT_S", 0.5)
    assert main(["sweep", "spec.toml", "--scheduler", "tcp://127.0.0.1:9"]) == 2
    assert "tcp://127.0.0.1:9" in capsys.readouterr().err.splitlines()[-1]
    settings = {"processes": False, "n_workers": 1, "threads_per_worker": 3, "dashboard_address": None}
    with distributed.LocalCluster(**settings) as cluster:
        assert main(["sweep", "spec.toml", "--scheduler", cluster.scheduler_address]) == 2
    assert "3 threads" in (error := capsys.readouterr().err.splitlines()[-1]) and "--nthreads 1" in error
    assert not flown


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (["sweep"], "--report"),
        (["sweep", "nowhere.toml"], "nowhere.toml"),
        (["sweep", "spec.toml", "--jobs", "0"], "--jobs"),
        (["sweep", "spec.toml", "--seed", "-1"], "--seed"),
        (["sweep", "spec.toml", "--dask", "--scheduler", "tcp://a:1"], "--scheduler"),
        (["sweep", "--report", "nowhere"], "nowhere"),
        (["sweep", "--report", "spec.toml"], "spec.toml"),
        (["sweep", "spec.toml", "--report", "run"], "--report"),
    ],
)
def test_refusals_are_one_line(flown, capsys, words, named):
    assert named in refusal(words, capsys)
    assert not flown


def test_plan_flies_nothing(flown, capsys):
    assert main(["sweep", "spec.toml", "--plan"]) == 0
    assert "24 flights in 8 blocks" in capsys.readouterr().out and not flown and not Path("runs").exists()


def test_seed_replaces_that_of_the_spec(flown):
    assert main(["sweep", "spec.toml", "--jobs", "1", "--json", "--seed", "40", "--out", "run"]) == 0
    assert set(table_of("run")["seed"]) == {40}


@pytest.mark.slow
def test_report_draws_boxes_maps_and_success(drawn, capsys):
    main(["sweep", "spec.toml", "--jobs", "1", "--json", "--out", "run"])
    page = Path("run/report.md").read_text()
    for name in ("success", "boxes-path_rms_m", "map-force_rms_n", "dependence"):
        assert f"figures/{name}.png" in page and Path(f"run/figures/{name}.png").stat().st_size > 5_000
    assert "| QP law | 12 |" in page and "lost" in page
    capsys.readouterr()
    assert (
        main(["sweep", "--report", "run/made_up.parquet", "--figures", "force_rms_n", "--out", "again", "--json"]) == 0
    )
    assert json.loads(capsys.readouterr().out) == {"schema": 1, "report": "again/report.md", "flights": RUNS}
    assert not Path("again/figures/map-path_rms_m.png").exists()
    assert main(["sweep", "--report", "run", "--figures", "nonsense"]) == 2
    assert "force_rms_n" in capsys.readouterr().err


@pytest.mark.slow
def test_report_of_parts_alone_and_of_a_single_parameter(drawn, tmp_path):
    Path("spec.toml").write_text(SPEC)
    run_sweep(Planned(load_spec(Path("spec.toml"))), Path("run/parts"), block_runs=3)
    assert main(["sweep", "--report", "run", "--figures", "force_rms_n", "--json", "--out", "from_parts"]) == 0
    table = pl.concat([pl.read_parquet(file) for file in Path("run/parts").glob("*.parquet")], how="diagonal_relaxed")
    write_table(tmp_path / "one.parquet", table.drop("param.scene.plant.mass_kg"))
    assert main(["sweep", "--report", "one.parquet", "--figures", "force_rms_n", "--json", "--out", "one"]) == 0
    assert Path("one/figures/success.png").exists() and not Path("one/figures/dependence.png").exists()


TINY = """
name = "tiny"
block_runs = 1
[fixed]
scene.start.distance_m = 0.15
job.hold_s = 0.5
[grid]
scene.wall.friction = [0.2, 0.6]
"""


@pytest.mark.slow
def test_one_worker_two_workers_and_a_cluster_of_processes_fly_the_same(tmp_path):
    pytest.importorskip("distributed", reason="a Dask cluster needs the extra cluster")
    (tmp_path / "spec.toml").write_text(TINY)
    tables = []
    for name, words in {"one": ["--jobs", "1"], "two": ["--jobs", "2"], "dask": ["--jobs", "2", "--dask"]}.items():
        assert main(["sweep", str(tmp_path / "spec.toml"), "--json", "--out", str(tmp_path / name), *words]) == 0
        tables.append(pl.read_parquet(tmp_path / name / "tiny.parquet"))
    assert tables[0].equals(tables[1]) and tables[0].equals(tables[2]) and tables[0]["completed"].all()
