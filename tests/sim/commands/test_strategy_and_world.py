"""``--strategy`` and ``--world``: flown by name, stated in every record, refused in one line."""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path

import numpy as np
import pytest
from contract_schema import refusal
from made_up_flights import fake_fly
from synthetic_trace import Errors, synthetic_trace

import ibvs_qp
import sim.flight.side_by_side
import sim.sweep.flying
from ibvs_qp.config.settings import dump_toml
from sim.commands.cli import main
from sim.experiments.design import Choice, designs, worlds_of
from sim.flight.flight_log import load_run
from sim.flight.jobs import Job, OwnJob
from sim.world.errors import GyroErrors, WorldErrors, world_errors
from sim.world.scene import Scene
from sim.world.worlds import DEFAULT_WORLD, OF_THE_SCENE, in_world, scene_in_world

PRESET = str(Path(ibvs_qp.__file__).parent / "pilot" / "presets" / "tarot_t960_qp.toml")
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


@pytest.mark.slow
def test_paint_flies_a_world_and_states_it_everywhere(flown, capsys):
    assert main([*PAINT, "--world", "harsh"]) == 0
    assert flown == [world_errors("harsh")]
    assert json.loads(capsys.readouterr().out)["world"] == "harsh"
    assert "world <b>harsh</b>" in Path("run/report.html").read_text(encoding="utf-8")
    with np.load("run/log.npz") as log:
        assert str(log["qp/world"]) == "harsh"
    assert load_run("run")["qp"].scene.errors == world_errors("harsh")


@pytest.mark.slow
def test_a_file_is_a_world_too(flown, capsys):
    Path("mine.toml").write_text("[gyro]\nbias_rad_s = 0.004\n", encoding="utf-8")
    assert main([*PAINT, "--world", "mine.toml"]) == 0
    assert flown[0].gyro.bias_rad_s == 0.004
    assert json.loads(capsys.readouterr().out)["world"] == "mine.toml"


SCENES = {
    "none": ("[wall]\nfriction = 0.4\n", DEFAULT_WORLD, world_errors(DEFAULT_WORLD)),
    "empty": ("[errors]\n", "ideal", WorldErrors()),
    "one": ("[errors.gyro]\nbias_rad_s = 0.004\n", OF_THE_SCENE, WorldErrors(gyro=GyroErrors(bias_rad_s=0.004))),
    "profile": (dump_toml(in_world(Scene(), "harsh")), "harsh", world_errors("harsh")),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", SCENES)
def test_errors_of_a_scene_file_hold_where_it_has_any_and_a_named_world_wins(flown, capsys, name):
    text, world, errors = SCENES[name]
    Path("scene.toml").write_text(text, encoding="utf-8")
    assert scene_in_world(Path("scene.toml"))[1] == world
    for words, expected in (([], (world, errors)), (["--world", "ideal"], ("ideal", WorldErrors()))):
        assert main([*PAINT, "--scene", "scene.toml", *words]) == 0
        assert (json.loads(capsys.readouterr().out)["world"], flown[-1]) == expected


@pytest.mark.slow
def test_every_command_has_the_same_default_world(flown, capsys):
    quick = ["--quick", "--features", "geometric", "--jobs", "1", "--json"]
    for words in (PAINT, ["compare", PRESET, PRESET, "--seeds", "1", *quick], ["experiment", "noise-sweep", *quick]):
        assert main(words) == 0
        assert json.loads(capsys.readouterr().out)["world"] == DEFAULT_WORLD
    assert set(flown) == {world_errors(DEFAULT_WORLD)}


@pytest.mark.slow
def test_the_tables_are_titled_with_the_world(flown, capsys):
    quick = ["--quick", "--features", "geometric", "--jobs", "1", "--world", "harsh"]
    paint = [word for word in PAINT if word != "--json"]
    experiment = ["experiment", "noise-sweep", *quick]
    for words in ([*paint, "--world", "harsh"], ["compare", PRESET, PRESET, "--seeds", "1", *quick], experiment):
        assert main(words) == 0
        assert "world harsh" in capsys.readouterr().out
    assert main([*paint[:-3], "--out", "other"]) == 0
    capsys.readouterr()
    assert main(["compare", "run", "other"]) == 0
    assert "world harsh against datasheet" in " ".join(capsys.readouterr().out.split())


def test_compare_and_experiment_fly_a_world(flown, capsys):
    flights = ["--quick", "--features", "geometric", "--jobs", "1", "--json", "--world", "harsh"]
    assert main(["compare", PRESET, PRESET, "--seeds", "1", *flights]) == 0
    assert json.loads(capsys.readouterr().out)["world"] == "harsh"
    assert main(["experiment", "noise-sweep", *flights, "--out", "all"]) == 0
    assert json.loads(capsys.readouterr().out)["world"] == "harsh"
    assert "--world harsh" in Path("all/results.md").read_text(encoding="utf-8")
    assert set(flown) == {world_errors("harsh")}


@pytest.mark.slow
def test_one_error_at_a_time_is_flown_in_the_ideal_world_and_named_so():
    runs = designs("mismatch", Choice(world="harsh"))
    (right,) = {run.plan.scene.errors for run in runs if run.params["error"] == "nothing"}
    assert right == WorldErrors() and worlds_of(runs, "harsh") == {"mismatch": ["ideal"]}
    assert worlds_of(designs("worlds", Choice()), "ideal") == {"worlds": ["ideal", "datasheet", "harsh"]}


@pytest.mark.parametrize("words", [["paint"], ["compare", PRESET, PRESET], ["experiment", "approach", "--quick"]])
def test_an_unknown_world_is_refused_in_one_line(flown, capsys, tmp_path, words):
    err = refusal([*words, "--world", "kind"], capsys)
    assert err.startswith("ibvs-qp: error: world 'kind' is refused; known worlds: datasheet, field, harsh, ideal")
    assert not flown and not any(tmp_path.iterdir())


ROOT = Path(__file__).parents[3]
EXAMPLE = f"{ROOT / 'examples' / 'own_path.py'}:OwnPath"
FLY = ["paint", "--law", "qp", "--features", "geometric", "--no-video", "--json", "--out", "run", "--strategy"]
#: A module of a user.
MODULE = """
from ibvs_qp import PaintingCommand, Strategy

class Hover(Strategy):
    legs = ((-0.3, 0.0),)
    def step(self, inputs):
        return self.leave(inputs, "hovered") if inputs.time_s > 1.0 else PaintingCommand(contact=False, standoff=0.4)

class Raises(Hover):
    def __init__(self, config):
        raise RuntimeError("two\\nlines")

class Forgets(Hover):
    def reset(self):
        self.mine = 1

class Late(Hover):
    def step(self, inputs):
        return 1.0 / 0.0 if inputs.time_s > 0.5 else PaintingCommand(contact=False, standoff=0.4)

class Bare(Strategy):
    pass

class Other:
    pass

number = 3
"""


@pytest.fixture
def folder(monkeypatch, tmp_path):
    """An empty current folder with the user's module; what it adds to Python is taken back."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))
    before = set(sys.modules)
    (tmp_path / "own_strategies.py").write_text(MODULE)
    (tmp_path / "broken.py").write_text("1 / 0\n")
    (tmp_path / "leaves.py").write_text("raise SystemExit(0)\n")
    yield tmp_path
    for name in set(sys.modules) - before:
        if name in ("own_strategies", "broken", "leaves", "own_path"):
            del sys.modules[name]


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("", "give module:Class or file.py:Class"),
        ("own_strategies", "give module:Class or file.py:Class"),
        ("own_strategies:", "give module:Class or file.py:Class"),
        (":Hover", "give module:Class or file.py:Class"),
        ("own_strategies:a b", "give module:Class or file.py:Class"),
        ("nowhere:Hover", "nowhere cannot be imported: ModuleNotFoundError: No module named 'nowhere'"),
        ("..:Hover", ".. cannot be imported: "),
        ("nowhere.py:Hover", "there is no file nowhere.py"),
        ("broken:Hover", "broken cannot be imported: ZeroDivisionError"),
        ("broken.py:Hover", "broken.py cannot be imported: ZeroDivisionError"),
        ("leaves:Hover", "leaves cannot be imported: SystemExit"),
        ("own_strategies:Missing", "own_strategies has no class Missing"),
        ("own_strategies:number", "own_strategies has no class number"),
        ("own_strategies:Other", "Other is no subclass of ibvs_qp.Strategy"),
        ("own_strategies:Bare", "Bare(...) raises TypeError: "),
        ("own_strategies:Raises", "Raises(...) raises RuntimeError: two lines"),
        ("own_strategies:Forgets", "Forgets has no log; begin its reset with super().reset()"),
    ],
)
def test_what_cannot_fly_is_refused_in_one_line(folder, capsys, name, words):
    assert words in refusal([*FLY, name], capsys)
    assert not (folder / "run").exists()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["own_strategies:Hover", "own_strategies.py:Hover", EXAMPLE])
def test_a_class_is_flown_by_module_or_file_and_stated_in_the_summary(folder, capsys, monkeypatch, name):
    flown: list[Job | None] = []

    def fly(scene, options, progress=None, job=None):
        flown.append(job)
        trace = fake_fly(scene, options, progress)
        trace.legs = ((-0.3, 0.0),)
        return trace

    monkeypatch.setattr(sim.flight.side_by_side, "fly", fly)
    assert main([*FLY, name]) == 0
    assert flown == [OwnJob(name=name)]
    summary = json.loads(capsys.readouterr().out)
    assert summary["strategy"] == name and summary["laws"]["qp"]["rows"] == []
    assert load_run("run")["qp"].legs == ((-0.3, 0.0),)


@pytest.mark.slow
def test_a_strategy_that_raises_in_flight_is_reported_and_the_vehicle_comes_back(folder, capsys):
    assert main([*FLY, "own_strategies:Late"]) == 0
    out, err = capsys.readouterr()
    figures = json.loads(out)["laws"]["qp"]
    assert not figures["completed"] and not figures["claimed"] and figures["not_completed"] == "leg 1: not painted"
    assert figures["reason"].startswith("strategy: ZeroDivisionError in step, line ") and "warning" not in err
    (event,) = [event for event in load_run("run")["qp"].events if event.kind == "retreat"]
    assert event.text == figures["reason"]


@pytest.mark.slow  # two flights of half a minute, and one with pictures
@pytest.mark.parametrize(("law", "features"), [("qp", "geometric"), ("paper", "geometric"), ("qp", "rendered")])
def test_the_example_paints_its_l(folder, capsys, law, features):
    changes = {"--law": law, "--features": features}
    words = [changes.get(before, word) for before, word in zip(["", *FLY], FLY, strict=False)]
    assert main([*words, EXAMPLE]) == 0
    out, err = capsys.readouterr()
    figures = json.loads(out)["laws"][law]
    assert figures["completed"] and figures["claimed"] and figures["not_completed"] is None, figures["not_completed"]
    assert figures["reason"] == "L painted" and figures["contact_share"] > 0.98 and "warning" not in err
