"""``--world``: flown, stated in every record, refused by name when unknown."""

from __future__ import annotations

import json
import os
from pathlib import Path

import numpy as np
import pytest
from made_up_flights import fake_fly
from synthetic_trace import Errors, synthetic_trace

import ibvs_qp
import sim.flight.side_by_side
import sim.sweep.flying
from ibvs_qp.config.settings import dump_toml
from sim.commands.cli import main
from sim.experiments.design import Choice, designs
from sim.flight.flight_log import load_run
from sim.world.errors import WorldErrors, world_errors
from sim.world.scene import Scene
from sim.world.worlds import DEFAULT_WORLD, EXPERIMENT_WORLD, in_world

PRESET = str(Path(ibvs_qp.__file__).parent / "presets" / "tarot_t960_qp.toml")
PAINT = ["paint", "--law", "qp", "--no-video", "--json", "--out", "run", "--overwrite"]


@pytest.fixture
def flown(monkeypatch, tmp_path):
    """Flights are made up, run folders lie in a temporary directory; the errors of the flown scenes."""
    found: list[WorldErrors] = []

    def fly(scene, options, *_, **__):
        found.append(scene.errors)
        return synthetic_trace(Errors(push_error_n=0.1), scene, options.law, options.seed)

    def paint(scene, *arguments, **named):
        found.append(scene.errors)
        return fake_fly(scene, *arguments, **named)

    monkeypatch.setattr(sim.flight.side_by_side, "fly", paint)
    monkeypatch.setattr(sim.sweep.flying, "fly", fly)
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0}, raising=False)
    monkeypatch.chdir(tmp_path)
    return found


def test_paint_flies_a_world_and_states_it_everywhere(flown, capsys):
    assert main([*PAINT, "--world", "harsh"]) == 0
    assert flown == [world_errors("harsh")]
    assert json.loads(capsys.readouterr().out)["world"] == "harsh"
    assert "world <b>harsh</b>" in Path("run/report.html").read_text(encoding="utf-8")
    with np.load("run/log.npz") as log:
        assert str(log["qp/world"]) == "harsh"
    assert load_run("run")["qp"].scene.errors == world_errors("harsh")


def test_a_file_is_a_world_too(flown, capsys):
    Path("mine.toml").write_text("[gyro]\nbias_rad_s = 0.004\n", encoding="utf-8")
    assert main([*PAINT, "--world", "mine.toml"]) == 0
    assert flown[0].gyro.bias_rad_s == 0.004
    assert json.loads(capsys.readouterr().out)["world"] == "mine.toml"


def test_a_scene_file_keeps_its_errors_unless_a_world_is_named(flown, capsys):
    Path("scene.toml").write_text(dump_toml(in_world(Scene(), "datasheet")), encoding="utf-8")
    for words, world in (([], "datasheet"), (["--world", "ideal"], "ideal")):
        assert main([*PAINT, "--scene", "scene.toml", *words]) == 0
        assert flown[-1] == world_errors(world)
        assert json.loads(capsys.readouterr().out)["world"] == world
    assert main(PAINT) == 0
    assert flown[-1] == world_errors(DEFAULT_WORLD)


def test_compare_and_experiment_fly_a_world(flown, capsys):
    flights = ["--quick", "--features", "geometric", "--jobs", "1", "--json", "--world", "datasheet"]
    assert main(["compare", PRESET, PRESET, "--seeds", "1", *flights]) == 0
    assert json.loads(capsys.readouterr().out)["world"] == "datasheet"
    assert main(["experiment", "noise-sweep", *flights, "--out", "all"]) == 0
    assert json.loads(capsys.readouterr().out)["world"] == "datasheet"
    assert "--world datasheet" in Path("all/results.md").read_text(encoding="utf-8")
    assert set(flown) == {world_errors("datasheet")}


def test_the_default_world_changes_no_experiment():
    plans = [run.plan for run in designs("approach", Choice(quick=True))]
    assert {plan.scene.errors for plan in plans} == {world_errors(EXPERIMENT_WORLD)}


@pytest.mark.parametrize("words", [["paint"], ["compare", PRESET, PRESET], ["experiment", "approach", "--quick"]])
def test_an_unknown_world_is_refused_in_one_line(flown, capsys, tmp_path, words):
    assert main([*words, "--world", "kind"]) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.count("\n") == 1
    assert err.startswith("ibvs-qp: error: world 'kind' is refused; known worlds: datasheet, harsh, ideal")
    assert not flown and not any(tmp_path.iterdir())
