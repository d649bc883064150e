"""The bench of the loop: every stage of a flown second, within one JSON line."""

from __future__ import annotations

import json

import pytest

from sim.bench import loop
from sim.commands.cli import main


def test_stages_of_both_flights_add_up(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture) -> None:
    monkeypatch.setattr(loop, "LONGEST_FLIGHT", 400)
    assert main(["bench", "loop", "--json"]) == 0
    (line,) = capsys.readouterr().out.splitlines()
    bench = json.loads(line)
    assert bench["schema"] == 1 and set(bench) == {"schema", "rows", "stages_us", "ratios"}
    stages = bench["stages_us"]
    assert set(stages) == {f"{flight}_{stage}" for flight in ("rendered", "geometric") for stage in loop.STAGES}
    assert {row["name"] for row in bench["rows"]} == set(stages)
    for flight in ("rendered", "geometric"):
        spent = [stages[f"{flight}_{stage}"] for stage in loop.STAGES]
        assert bench["ratios"][f"{flight}_real_time"] == pytest.approx(1e6 / sum(spent))
    assert stages["geometric_drawing"] == stages["geometric_vision"] == 0.0
    assert all(spent > 0.0 for name, spent in stages.items() if name.startswith("rendered"))


def test_the_table_names_every_stage(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture) -> None:
    monkeypatch.setattr(loop, "LONGEST_FLIGHT", 300)
    assert main(["bench", "loop"]) == 0
    out = capsys.readouterr().out
    assert all(stage in out for stage in loop.STAGES) and "real-time factor" in out
