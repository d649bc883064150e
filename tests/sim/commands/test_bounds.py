"""Numbers beyond every use end at once in one line with option, value and range."""

from __future__ import annotations

from pathlib import Path

import pytest
from contract_schema import refusal

from ibvs_qp.pilot.presets import FOLDER
from sim.commands.cli import main

HUGE = "5000000000000000000000"
PAIR = " ".join(str(FOLDER / f"tarot_t960_{law}.toml") for law in ("qp", "paper"))
SPECS = {
    "samples = 1000000000\n[random]\nscene.wall.friction = {low = 0.1, high = 0.5}": "samples = 1000000000",
    f"[grid]\nscene.wall.friction = [{'0.3, ' * 150_000}]": "150000 values",
    "seeds = 1000\n[grid]\nscene.wall.friction = {low = 0.1, high = 0.5, steps = 100000}": "100000000 flights",
}


@pytest.fixture(autouse=True)
def in_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


@pytest.mark.timeout(20)
@pytest.mark.parametrize(
    ("words", "option"),
    [
        ("faults --plan", "--seeds"),
        ("faults --plan", "--jobs"),
        ("faults --plan", "--seed"),
        ("tune", "--trials"),
        ("tune", "--flights"),
        ("tune", "--unseen"),
        ("tune", "--jobs"),
        ("tune", "--seed"),
        ("experiment approach --plan", "--seed"),
        ("experiment approach --plan", "--jobs"),
        (f"compare {PAIR}", "--seeds"),
        (f"compare {PAIR}", "--seed"),
        ("paint", "--seed"),
    ],
)
def test_counts(words: str, option: str, capsys: pytest.CaptureFixture[str]) -> None:
    err = refusal(f"{words} {option} {HUGE}".split(), capsys)
    assert f"{option} = {HUGE}" in err and "allowed is" in err


@pytest.mark.timeout(20)
@pytest.mark.parametrize("text", SPECS, ids=lambda text: SPECS[text])
def test_sweeps(text: str, capsys: pytest.CaptureFixture[str]) -> None:
    Path("x.toml").write_text(text)
    err = refusal(["sweep", "x.toml", "--plan"], capsys)
    assert SPECS[text] in err and "refused" in err


@pytest.mark.timeout(20)
def test_a_fine_grid_is_planned_at_once(capsys: pytest.CaptureFixture[str]) -> None:
    Path("x.toml").write_text("[grid]\nscene.wall.friction = {low = 0.1, high = 0.5, steps = 100000}")
    assert main(["sweep", "x.toml", "--plan"]) == 0
    assert "100000 flights" in capsys.readouterr().out
