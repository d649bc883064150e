"""``ibvs-qp vehicle``."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from sim.commands.cli import main

FLAT = """[vehicle]
mass_kg = 2.0
[vehicle.geometry]
circle_radius_m = 0.25
torque_ratio_m = 0.02
rotors = [{name = "[bold]a", azimuth_deg = 45, spin = 1}, {name = "b", azimuth_deg = 135, spin = -1},
          {name = "c", azimuth_deg = -135, spin = 1}, {name = "d", azimuth_deg = -45, spin = -1}]
"""


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def summary(capsys: pytest.CaptureFixture[str], *words: str) -> dict[str, object]:
    assert main(["vehicle", *words, "--json"]) == 0
    return json.loads(capsys.readouterr().out)


def test_px4_parameters_have_the_same_effectiveness(capsys: pytest.CaptureFixture[str]) -> None:
    written = summary(capsys, "tarot_t960_qp", "--px4", "t960.params")
    found = summary(capsys, "t960.params")
    np.testing.assert_allclose(found["effectiveness"], written["effectiveness"], atol=1e-8)  # type: ignore[arg-type]
    assert found["missing"] == [] and found["hovers"] is True and written["push_n"] == pytest.approx(30.4, abs=0.1)


def test_a_shipped_preset_is_shown_and_drawn(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["vehicle", "octorotor_qp", "--picture", "o.png"]) == 0
    text = capsys.readouterr().out
    for words in (
        "6 kg, 8 rotors",
        "Control effectiveness B",
        "Fully actuated; condition",
        "Push at the tip:",
        "o.png",
    ):
        assert words in text
    assert Path("o.png").read_bytes()[:4] == b"\x89PNG"


def test_what_is_not_actuated_is_named(capsys: pytest.CaptureFixture[str]) -> None:
    Path("flat.toml").write_text(FLAT)
    assert main(["vehicle", "flat.toml"]) == 0
    text = capsys.readouterr().out
    assert "Not fully actuated." in text and "  force front\n  force right\n" in text and "[bold]a" in text


@pytest.mark.parametrize(
    ("words", "needle"),
    [
        (["none.toml"], "none.toml"),
        (["none.params"], "none.params"),
        (["bad.params"], "bad.params: CA_ROTOR_COUNT = 0 is refused"),
        (["bad.toml"], "bad.toml: unknown key 'vehicle.mass'; did you mean 'mass_kg'?"),
        (["tarot_t960_qp", "--picture", "a.doc"], "--picture = 'a.doc'"),
        (["tarot_t960_qp", "--px4", "no/folder.params"], "no/folder.params: No such file or directory"),
    ],
)
def test_user_errors_are_one_line(capsys: pytest.CaptureFixture[str], words: list[str], needle: str) -> None:
    Path("bad.params").write_text("hello\n")
    Path("bad.toml").write_text("[vehicle]\nmass = 3.0\n")
    assert main(["vehicle", *words]) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.count("\n") == 1 and needle in err
