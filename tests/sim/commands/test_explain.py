"""`ibvs-qp explain`: solves a recorded tick again and prints it; the log restores the flight."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest
from closed_loop_rigs import short_scene
from contract_schema import refusal

from ibvs_qp.config.settings import dump_toml
from ibvs_qp.controller import qp_problem
from ibvs_qp.symbolic.signals import places
from sim.commands.cli import main
from sim.evaluate.explanation import explain_tick, flown_config
from sim.evaluate.explanation_text import explanation_tables
from sim.flight.closed_loop import fly
from sim.flight.flight_log import load_run, save_log
from sim.flight.options import FlightOptions
from sim.flight.trace import Event, Trace


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Trace]:
    """The start of a flight under both laws, as `paint` leaves it."""
    folder = tmp_path_factory.mktemp("run")
    scene = short_scene(0.1, rows=1)
    traces = {}
    for law in ("qp", "paper"):
        trace = fly(scene, FlightOptions(law=law, features="geometric", video=False))
        traces[law] = trace
    (folder / "scene.toml").write_text(dump_toml(scene))
    save_log(folder / "log.npz", traces)
    return folder, traces["qp"]


@pytest.mark.slow
def test_recorded_ticks_solve_to_the_thrusts_that_flew(run: tuple[Path, Trace]) -> None:
    trace = load_run(run[0])["qp"]
    for tick in range(0, len(trace.t), len(trace.t) // 25):
        _, explanation = explain_tick(trace, tick)
        assert explanation is not None
        np.testing.assert_allclose(explanation.thrusts, trace.thrusts[tick], atol=2e-2)
        assert sum(explanation.cost) + explanation.slack_cost == pytest.approx(1.0)
        for name in {limit.name for limit in explanation.active_limits if limit.price > 1.0}:
            assert trace.active[tick, trace.limits.index(name)], name


def test_text_and_json(run: tuple[Path, Trace], capsys: pytest.CaptureFixture[str]) -> None:
    folder, trace = run
    at = float(trace.t[np.flatnonzero(trace.contact_weight > 0.9)[0]])
    assert main(["explain", str(folder), "--at", f"{at:.3f}"]) == 0
    text = capsys.readouterr().out
    for word in ("push", "line_0", "pitch", "mid_right", "Thrusts", "damping ratio"):
        assert word in text
    assert main(["explain", str(folder), "--at", f"{at:.3f}", "--json"]) == 0
    table = json.loads(capsys.readouterr().out)
    assert table["schema"] == 1 and table["t"] == pytest.approx(at, abs=0.002)
    names = [task["name"] for task in table["tasks"]]
    assert "push" in names and len(table["thrusts"]) == 6


def test_rotors_have_the_names_and_the_window_of_the_tick(
    run: tuple[Path, Trace], capsys: pytest.CaptureFixture[str]
) -> None:
    """Limits of the program: the rate limit around the last thrusts, not the box of the data sheet."""
    folder, trace = run
    tick = int(np.flatnonzero(trace.contact_weight > 0.9)[0])
    assert main(["explain", str(folder), "--at", f"{trace.t[tick]:.3f}", "--json"]) == 0
    table = json.loads(capsys.readouterr().out)
    step = 500.0 * 0.004
    before = trace.thrusts[tick - 1]
    np.testing.assert_allclose(table["thrust_lower"], np.maximum(before - step, 1.2), atol=1e-4)
    np.testing.assert_allclose(table["thrust_upper"], np.minimum(before + step, 52.56), atol=1e-4)
    assert table["reach_margin"] == pytest.approx(float(trace.reach_margin[tick]))
    assert table["push_asked"] == trace.scene.paint.push_n and table["push_reduced"] is None
    assert table["push_measured"] == pytest.approx(float(trace.push_measured[tick]))
    config, explanation = explain_tick(trace, tick)
    assert explanation is not None
    vehicle = config.controller.vehicle
    renamed = tuple(dataclasses.replace(rotor, name=f"own_{i}") for i, rotor in enumerate(vehicle.geometry.rotors))
    vehicle = dataclasses.replace(vehicle, geometry=dataclasses.replace(vehicle.geometry, rotors=renamed))
    own = dataclasses.replace(config, controller=dataclasses.replace(config.controller, vehicle=vehicle))
    text = shown(explanation_tables(trace, tick, explanation, own), capsys)
    assert "own_0" in text and "own_5" in text and "mid_right" not in text
    assert f"{table['thrust_upper'][0]:.3f}" in text and "52.56" not in text


def test_a_hold_tick_is_not_explained_by_the_program_of_an_earlier_tick(
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
    text = " ".join(capsys.readouterr().out.split())
    assert "Outcome hold: no program was solved" in text and "Tasks" not in text and "residual" not in text
    assert "specific_force: not finite" in text and "measurement.plane" not in text
    assert main(["explain", str(tmp_path), "--at", f"{at:.3f}", "--json"]) == 0
    table = json.loads(capsys.readouterr().out)
    assert table["outcome"] == "hold" and table["tasks"] == [] and table["active_limits"] == []
    assert table["thrusts"] == table["flown_thrusts"] and table["thrust_upper"] is None
    assert table["rejected"] == [{"t": at, "text": rejected.text}]


def test_a_lowered_push_is_printed_with_the_jobs(run: tuple[Path, Trace], capsys: pytest.CaptureFixture[str]) -> None:
    _, trace = run
    tick = int(np.flatnonzero(trace.push_reference >= trace.scene.paint.push_n)[0])
    config, explanation = explain_tick(trace, tick)
    assert explanation is not None
    greedy = dataclasses.replace(config, painting=dataclasses.replace(config.painting, push_n=35.0))
    reasons = ["reach 4.9 N of 35.0 N asked: friction 0.80 assumed", "standing still, no longer the last"]
    events = [Event(t=float(trace.t[tick]) + late, kind="push reduced", text=text) for late, text in enumerate(reasons)]
    reduced = dataclasses.replace(trace, events=events)
    text = shown(explanation_tables(reduced, tick, explanation, greedy), capsys)
    commanded, measured = float(trace.push_reference[tick]), float(trace.push_measured[tick])
    assert f"push asked 35.00 N, commanded {commanded:.2f} N, measured {measured:.2f} N (reduced: {reasons[0]})" in text
    assert f"{trace.reach_margin[tick]:.2f} N further" in text
    restored = Event(t=float(trace.t[tick]), kind="push restored", text="35.0 N of 35.0 N asked")
    for flown in (trace, dataclasses.replace(trace, events=[*events[:1], restored])):
        assert "(reduced: by the ramp after touch)" in shown(
            explanation_tables(flown, tick, explanation, greedy), capsys
        )
    assert "reduced" not in shown(explanation_tables(trace, tick, explanation, config), capsys)


def turning(trace: Trace, tick: int, rate: float, pitch: float = 0.0, hard: bool = False) -> Trace:
    """The flight with a pitch rate [rad/s] and angle [rad] of its own in a tick, barriers hard or soft.

    The attitude filter begins in this tick and returns the measured angle; later ticks move it by a share of the step.
    """
    config = flown_config(trace)
    limits = dataclasses.replace(config.controller.limits, hard_barriers=hard)
    config = dataclasses.replace(config, controller=dataclasses.replace(config.controller, limits=limits))
    program = trace.arrays["program"].copy()
    signals = qp_problem(config.controller).model.signals
    place = places(signals.inputs | signals.states)
    program[tick, place["attitude"]] = (np.cos(pitch / 2.0), 0.0, np.sin(pitch / 2.0), 0.0)
    program[tick, place["angular_velocity"]] = (0.0, rate, 0.0)
    program[tick, place["roll_pitch_begun"]] = 0.0
    return dataclasses.replace(trace, arrays=trace.arrays | {"program": program}, preset=dump_toml(config))


def test_cost_of_slack_has_bound_and_unit(
    run: tuple[Path, Trace], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, trace = run
    tick = int(np.flatnonzero(trace.contact_weight > 0.9)[0])
    config, explanation = explain_tick(turning(trace, tick, 0.0, pitch=0.3), tick)
    assert explanation is not None
    by_name = {limit.name: place for place, limit in enumerate(explanation.active_limits)}
    at = by_name["tilt_pitch"]
    limit, row, paid = explanation.active_limits[at], explanation.limit_rows[at], explanation.limit_cost[at]
    assert limit.side == "upper" and limit.slack > 0.01 and row.name == limit.name and row.unit == "rad/s^2"
    bound = 144.0 * (np.deg2rad(1.0) - 0.3)  # p^2 (phi_max - phi) - 2 p rate, with p = 12 1/s
    assert row.upper == pytest.approx(bound, abs=0.5) and row.value - row.upper == pytest.approx(limit.slack)
    price = config.controller.limits.tilt_slack_weight
    assert paid * explanation.total_cost == pytest.approx(0.5 * price * limit.slack**2)
    assert sum(explanation.limit_cost) == pytest.approx(explanation.slack_cost, rel=1e-6)
    text = shown(explanation_tables(trace, tick, explanation, config), capsys)
    line, price_line = (line for line in text.splitlines() if line.lstrip().startswith("tilt_pitch "))
    assert f"{row.upper:.4g}" in line and "rad/s^2" in line and f"({paid:.0%})" in line
    span = explanation.limit_ranges[at]
    assert (
        f"{span.cost_fall:.3g}" in price_line and f"{span.change_high:+.3g}" in price_line and span.until in price_line
    )
    assert 0.0 < span.cost_fall < limit.price * span.change_high and "derivative of the program's cost" in text
    assert "Slack takes" in text and "per squared unit" in text
    (tmp_path / "scene.toml").write_text((folder / "scene.toml").read_text())
    save_log(tmp_path / "log.npz", {"qp": turning(trace, tick, 0.0, pitch=0.3)})
    assert main(["explain", str(tmp_path), "--at", f"{trace.t[tick]:.3f}", "--json"]) == 0
    table = json.loads(capsys.readouterr().out)
    (entry,) = [entry for entry in table["active_limits"] if entry["name"] == "tilt_pitch"]
    assert entry["cost_fall"] == pytest.approx(span.cost_fall, rel=1e-3) and entry["until"] == span.until
    assert entry["cost_share"] == pytest.approx(paid) and entry["upper"] == pytest.approx(row.upper, abs=1e-6)
    assert table["slack_cost_share"] == pytest.approx(explanation.slack_cost) and table["conflict"] == []


def test_hard_limits_in_conflict_are_listed(
    run: tuple[Path, Trace], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Turning at 3 rad/s, more pitch moment is needed than the rotors have within their rate limit."""
    folder, trace = run
    tick = int(np.flatnonzero(trace.contact_weight > 0.9)[0])
    (tmp_path / "scene.toml").write_text((folder / "scene.toml").read_text())
    save_log(tmp_path / "log.npz", {"qp": turning(trace, tick, 3.0, hard=True)})
    words = ["explain", str(tmp_path), "--at", f"{trace.t[tick]:.3f}"]
    assert main(words) == 0
    text = " ".join(capsys.readouterr().out.split())
    assert "No thrusts satisfy these" in text and "tilt_pitch" in text and "hard_barriers = false" in text
    assert "Tasks" not in text and "exact" not in text
    assert main([*words, "--json"]) == 0
    table = json.loads(capsys.readouterr().out)
    rows = {row["name"]: row for row in table["conflict"]}
    assert rows["tilt_pitch"]["value"] > rows["tilt_pitch"]["upper"]  # the flown thrusts break it
    rotors = {name: row for name, row in rows.items() if name.startswith("thrust_")}
    names = flown_config(trace).controller.vehicle.geometry.names
    for name, row in rotors.items():
        place = names.index(name.removeprefix("thrust_"))
        assert row["unit"] == "N" and row["lower"] == pytest.approx(table["thrust_lower"][place])
        assert row["value"] == pytest.approx(trace.thrusts[tick][place])
    assert rotors and table["tasks"] == [] and table["total_cost"] is None


def shown(parts: list[object], capsys: pytest.CaptureFixture[str]) -> str:
    """Console output."""
    from rich.console import Console

    capsys.readouterr()
    for part in parts:
        Console(width=160).print(part)
    return capsys.readouterr().out


def test_an_unusable_run_or_tick_is_one_line(
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
        assert why in refusal(["explain", *words], capsys)
