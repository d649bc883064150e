"""``ibvs-qp compare`` with two presets: flights, refusals, interrupt."""

from __future__ import annotations

import json

import pytest
from synthetic_trace import Errors, synthetic_trace

import sim.sweep.flying
from ibvs_qp.pilot.presets import FOLDER
from sim.commands.cli import main

PAIR = [str(FOLDER / "tarot_t960_qp.toml"), str(FOLDER / "tarot_t960_paper.toml")]
SHORT = ["--quick", "--features", "geometric", "--seeds", "1", "--jobs", "1", "--json"]


@pytest.fixture
def flown(monkeypatch, tmp_path):
    """Flights are synthetic and counted."""
    flights: list[str] = []

    def fly(scene, options, *, config, job, faults):
        flights.append(options.law)
        return synthetic_trace(Errors(push_error_n=0.1), scene, options.law, options.seed)

    monkeypatch.setattr(sim.sweep.flying, "fly", fly)
    monkeypatch.chdir(tmp_path)
    return flights


@pytest.mark.slow
def test_two_presets_fly_the_same_short_job(tmp_path, capsys):
    assert main(["compare", *PAIR, *SHORT, "--out", str(tmp_path / "run")]) == 0
    content = json.loads(capsys.readouterr().out)
    (cell,) = content["cells"]
    assert (cell["law"], cell["n"], cell["completed"]) == ("own", 1, [1, 1])
    path = cell["differences"]["path_rms_m"]
    assert 0.0 < path["a"] < 0.01 and 0.0 < path["b"] < 0.01 and path["a"] != path["b"]
    assert content["run_dir"] == str(tmp_path / "run") and not content["interrupted"]


def test_presets_fly_the_law_that_they_name(flown, capsys):
    assert main(["compare", *PAIR, *SHORT]) == 0
    assert flown == ["qp", "paper"]
    assert json.loads(capsys.readouterr().out)["cells"][0]["n"] == 1


@pytest.mark.parametrize(
    ("words", "named"),
    [
        ([*PAIR, "--seeds", "0"], "--seeds"),
        ([*PAIR, "--jobs", "0"], "--jobs"),
        ([PAIR[0], "."], "is a file and . a folder"),
        ([PAIR[0], "nowhere.toml"], "nowhere.toml does not exist"),
    ],
)
def test_refusals_are_one_line_and_fly_nothing(flown, capsys, words, named):
    assert main(["compare", *words]) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.count("\n") == 1 and named in err
    assert not flown


@pytest.mark.parametrize("done", [0, 1])
def test_interrupt_names_the_folder_and_goes_on(flown, monkeypatch, capsys, done):
    whole = sim.sweep.flying.fly

    def fly(*arguments, **named):
        if len(flown) == done:
            raise KeyboardInterrupt
        return whole(*arguments, **named)

    monkeypatch.setattr(sim.sweep.flying, "fly", fly)
    assert main(["compare", *PAIR, *SHORT, "--out", "run"]) == 130
    out, err = capsys.readouterr()
    content = json.loads(out)
    assert content["interrupted"] and content["cells"] == []
    assert "finished flights are in" in err and "go on with: ibvs-qp compare" in err and "--out run" in err
    monkeypatch.setattr(sim.sweep.flying, "fly", whole)
    assert main(["compare", *PAIR, *SHORT, "--out", "run"]) == 0
    assert len(flown) == 2
