"""``--strategy``: a class of the user's is flown by name, and refused in one line before anything is written."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest
from made_up_flights import fake_fly

import sim.flight.side_by_side
from sim.commands.cli import main
from sim.flight.flight_log import load_run
from sim.flight.jobs import Job, OwnJob

ROOT = Path(__file__).parents[3]
EXAMPLE = f"{ROOT / 'examples' / 'own_path.py'}:OwnPath"
PAINT = ["paint", "--law", "qp", "--features", "geometric", "--no-video", "--json", "--out", "run", "--strategy"]
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
    assert main([*PAINT, name]) == 2
    out, err = capsys.readouterr()
    assert not out and err.count("\n") == 1 and words in err and not (folder / "run").exists()


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
    assert main([*PAINT, name]) == 0
    assert flown == [OwnJob(name=name)]
    summary = json.loads(capsys.readouterr().out)
    assert summary["strategy"] == name and summary["laws"]["qp"]["rows"] == []
    assert load_run("run")["qp"].legs == ((-0.3, 0.0),)


@pytest.mark.slow
def test_a_strategy_that_raises_in_flight_is_reported_and_the_vehicle_comes_back(folder, capsys):
    assert main([*PAINT, "own_strategies:Late"]) == 0
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
    words = [changes.get(before, word) for before, word in zip(["", *PAINT], PAINT, strict=False)]
    assert main([*words, EXAMPLE]) == 0
    out, err = capsys.readouterr()
    figures = json.loads(out)["laws"][law]
    assert figures["completed"] and figures["claimed"] and figures["not_completed"] is None, figures["not_completed"]
    assert figures["reason"] == "L painted" and figures["contact_share"] > 0.98 and "warning" not in err
