"""`ibvs-qp explain`: a recorded tick is solved again and told in words; the log gives back what was flown."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest
from closed_loop_rigs import short_scene

from sim.cli import main
from sim.closed_loop import FlightOptions, fly
from sim.explanation import explain_tick
from sim.flight_log import load_run, save_log
from sim.trace import Trace


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Trace]:
    """The start of a flight under both laws, as `paint` leaves it."""
    from ibvs_qp.settings import dump_toml

    folder = tmp_path_factory.mktemp("run")
    scene = short_scene(0.1, rows=1)
    traces = {}
    for law in ("qp", "paper"):
        trace = fly(scene, FlightOptions(law=law, features="geometric", video=False))
        traces[law] = trace
    (folder / "scene.toml").write_text(dump_toml(scene))
    save_log(folder / "log.npz", traces)
    return folder, traces["qp"]


def test_recorded_ticks_solve_to_the_thrusts_that_flew(run: tuple[Path, Trace]) -> None:
    trace = load_run(run[0])["qp"]
    for tick in range(0, len(trace.t), len(trace.t) // 25):
        _, explanation = explain_tick(trace, tick)
        assert explanation is not None
        np.testing.assert_allclose(explanation.thrusts, trace.thrusts[tick], atol=2e-2)
        assert sum(explanation.cost) + explanation.slack_cost == pytest.approx(1.0)
        for name in {limit.name for limit in explanation.active_limits if limit.price > 1.0}:
            assert trace.active[tick, trace.limits.index(name)], name


def test_for_a_person_and_as_json(run: tuple[Path, Trace], capsys: pytest.CaptureFixture[str]) -> None:
    folder, trace = run
    at = float(trace.t[np.flatnonzero(trace.contact_weight > 0.9)[0]])
    assert main(["explain", str(folder), "--at", f"{at:.3f}"]) == 0
    told = capsys.readouterr().out
    for word in ("push", "line_0", "pitch", "mid_right", "Thrusts", "damping ratio"):
        assert word in told
    assert main(["explain", str(folder), "--at", f"{at:.3f}", "--json"]) == 0
    table = json.loads(capsys.readouterr().out)
    assert table["schema"] == 1 and table["t"] == pytest.approx(at, abs=0.002)
    names = [task["name"] for task in table["tasks"]]
    assert "push" in names and len(table["thrusts"]) == 6


def test_what_cannot_be_explained_is_said_in_one_line(
    run: tuple[Path, Trace], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, trace = run
    only_paper = tmp_path / "paper"
    only_paper.mkdir()
    (only_paper / "scene.toml").write_text((folder / "scene.toml").read_text())
    save_log(only_paper / "log.npz", {"paper": dataclasses.replace(trace, law="paper")})
    for words, why in (
        ([str(folder), "--at", "1e4"], "the flight lasts from"),
        ([str(tmp_path), "--at", "1"], "no run folder"),
        ([str(only_paper), "--at", "1"], "no flight under the QP law"),
        ([str(folder), "--at", "1", "--seed", "7"], "flown with seed 0"),
    ):
        assert main(["explain", *words]) == 2
        said = capsys.readouterr().err
        assert why in said and said.count("\n") == 1
