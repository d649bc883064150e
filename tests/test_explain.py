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
from sim.explanation import explain_tick, explanation_tables
from sim.flight_log import load_run, save_log
from sim.trace import Event, Trace


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


def test_rotors_have_the_names_and_the_window_of_the_tick(
    run: tuple[Path, Trace], capsys: pytest.CaptureFixture[str]
) -> None:
    """What the program knew: the rate limit around the last thrusts, not the box of the data sheet."""
    folder, trace = run
    tick = int(np.flatnonzero(trace.contact_weight > 0.9)[0])
    assert main(["explain", str(folder), "--at", f"{trace.t[tick]:.3f}", "--json"]) == 0
    table = json.loads(capsys.readouterr().out)
    step = 500.0 * 0.004
    before = trace.thrusts[tick - 1]
    np.testing.assert_allclose(table["thrust_lower"], np.maximum(before - step, 1.2), atol=1e-4)
    np.testing.assert_allclose(table["thrust_upper"], np.minimum(before + step, 52.56), atol=1e-4)
    assert table["reach_margin"] == pytest.approx(float(trace.reach_margin[tick]))
    assert table["push_asked"] == trace.scene.paint.push_n
    config, explanation = explain_tick(trace, tick)
    assert explanation is not None
    vehicle = config.controller.vehicle
    renamed = tuple(dataclasses.replace(rotor, name=f"own_{i}") for i, rotor in enumerate(vehicle.geometry.rotors))
    vehicle = dataclasses.replace(vehicle, geometry=dataclasses.replace(vehicle.geometry, rotors=renamed))
    own = dataclasses.replace(config, controller=dataclasses.replace(config.controller, vehicle=vehicle))
    told = shown(explanation_tables(trace, tick, explanation, own), capsys)
    assert "own_0" in told and "own_5" in told and "mid_right" not in told
    assert f"{table['thrust_upper'][0]:.3f}" in told and "52.56" not in told


def test_a_held_tick_is_not_explained_by_the_program_of_an_earlier_one(
    run: tuple[Path, Trace], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, trace = run
    tick = int(np.flatnonzero(trace.contact_weight > 0.9)[0])
    outcome = trace.outcome.copy()
    outcome[tick] = trace.outcomes.index("hold")
    at = float(trace.t[tick])
    rejected = Event(t=at, kind="rejected", text="measurement.specific_force: not finite")
    late = Event(t=at + 1.0, kind="rejected", text="measurement.plane: not finite")
    held = dataclasses.replace(trace, arrays=trace.arrays | {"outcome": outcome}, events=[rejected, late])
    (tmp_path / "scene.toml").write_text((folder / "scene.toml").read_text())
    save_log(tmp_path / "log.npz", {"qp": held})
    assert main(["explain", str(tmp_path), "--at", f"{at:.3f}"]) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert "held" in told and "no program was solved" in told and "Tasks" not in told and "residual" not in told
    assert "specific_force: not finite" in told and "measurement.plane" not in told
    assert main(["explain", str(tmp_path), "--at", f"{at:.3f}", "--json"]) == 0
    table = json.loads(capsys.readouterr().out)
    assert table["outcome"] == "hold" and table["tasks"] == [] and table["active_limits"] == []
    assert table["thrusts"] == table["flown_thrusts"] and table["thrust_upper"] is None
    assert table["rejected"] == [{"t": at, "text": rejected.text}]


def test_a_push_below_the_jobs_is_told_beside_it(run: tuple[Path, Trace], capsys: pytest.CaptureFixture[str]) -> None:
    _, trace = run
    tick = int(np.flatnonzero(trace.push_reference >= trace.scene.paint.push_n)[0])
    config, explanation = explain_tick(trace, tick)
    assert explanation is not None
    greedy = dataclasses.replace(config, painting=dataclasses.replace(config.painting, push_n=35.0))
    told = shown(explanation_tables(trace, tick, explanation, greedy), capsys)
    assert "35.00 N by the job" in told and f"{trace.reach_margin[tick]:.2f} N further" in told
    assert "by the job" not in shown(explanation_tables(trace, tick, explanation, config), capsys)


def shown(parts: list[object], capsys: pytest.CaptureFixture[str]) -> str:
    """What a person reads."""
    from rich.console import Console

    capsys.readouterr()
    for part in parts:
        Console(width=160).print(part)
    return capsys.readouterr().out


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
