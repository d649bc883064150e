"""``ibvs-qp faults`` with made-up flights: contract, files, resume, refusals."""

from __future__ import annotations

import json

import polars as pl
import pytest
from contract_schema import refusal
from synthetic_trace import synthetic_trace

import sim.sweep.flying
from sim.commands.cli import main
from sim.flight.trace import Event

WORDS = ["faults", "--rows", "F/T zero", "--world", "ideal", "--seeds", "2", "--jobs", "1", "--out", "run"]


@pytest.fixture
def flown(monkeypatch, tmp_path):
    """Flights are made up: the supervisor retreats 0.2 s after the fault; without it an exception ends the flight."""
    flights: list[tuple[bool, int]] = []

    def fly(scene, options, *, config, job, faults):
        flights.append((config.safety.supervise, options.seed))
        if not config.safety.supervise:
            raise ValueError("made up")
        trace = synthetic_trace(scene=scene, seed=options.seed)
        fault_s = float(trace.t[trace.push_true > 0.05][-1]) - 0.5
        trace.events.append(Event(t=fault_s, kind="fault", text=faults[0].words))
        trace.events.append(Event(t=fault_s + 0.2, kind="safety", text="retreat: F/T sensor: the same value 10 times"))
        return trace

    monkeypatch.setattr(sim.sweep.flying, "fly", fly)
    monkeypatch.chdir(tmp_path)
    return flights


def test_json_is_one_line_and_equals_the_file(flown, tmp_path, capsys):
    assert main([*WORDS, "--json"]) == 0
    out, err = capsys.readouterr()
    assert err == "" and out.count("\n") == 1
    content = json.loads(out)
    assert json.loads((tmp_path / "run" / "faults.json").read_text()) == content
    assert (content["schema"], content["name"], content["worlds"]) == (1, "faults", ["ideal"])
    assert (content["rows_met"], content["rows_flown"], content["proves_nothing"]) == (2, 2, [])
    assert [(row["fault"], row["place"], row["met"]) for row in content["rows"]] == [
        ("F/T zero", "contact", True),
        ("F/T zero", "free", True),
    ]
    assert content["rows"][0]["supervised"]["retreat_s"] == pytest.approx(0.2)
    assert "made up" in content["rows"][0]["control"]["failures"][0]["criteria"][0]
    assert pl.read_parquet(content["data_file"]).height == len(flown) == 8


def test_the_page_says_how_it_was_made(flown, tmp_path):
    assert main([*WORDS, "--json"]) == 0
    page = (tmp_path / "run" / "faults.md").read_text()
    assert "Generated from data by `ibvs-qp faults --seeds 2 --rows 'F/T zero' --world ideal`" in page
    assert "| F/T zero | contact | 2/2 |" in page and "| 2/2 | exception |" in page


def test_the_same_folder_flies_nothing_twice(flown, capsys):
    for _ in range(2):
        assert main(WORDS) == 0
    assert len(flown) == 8
    assert "F/T zero" in capsys.readouterr().out


def test_ctrl_c_writes_what_was_flown_and_says_how_to_go_on(flown, monkeypatch, capsys):
    whole = sim.sweep.flying.fly

    def fly(*arguments, **named):
        if len(flown) == 3:
            raise KeyboardInterrupt
        return whole(*arguments, **named)

    monkeypatch.setattr(sim.sweep.flying, "fly", fly)
    assert main([*WORDS, "--json"]) == 130
    out, err = capsys.readouterr()
    assert json.loads(out)["interrupted"] and "go on with: ibvs-qp faults" in err


def test_plan_and_refusals_fly_nothing(flown, capsys):
    assert main([*WORDS, "--plan"]) == 0
    assert "8 flights, 4 of them without the supervisor" in capsys.readouterr().out
    for words, named in ((["--rows", "x*y"], "--rows"), (["--seeds", "0"], "--seeds"), (["--world", "mars"], "mars")):
        assert named in refusal(["faults", *words, "--out", "run"], capsys)
    assert not flown
