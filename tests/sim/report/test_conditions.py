"""What two runs did not have in common is named before their figures are compared."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import ibvs_qp
from ibvs_qp.pilot.presets import FILES
from sim.commands.cli import main
from sim.report.comparison import differing_presets, differing_runs


@pytest.fixture
def runs(tmp_path: Path) -> tuple[Path, Path]:
    for name, world, slope in (("a", "ideal", 0.0), ("b", "harsh", 2.0)):
        folder = tmp_path / name
        folder.mkdir()
        laws = {"qp": {"completed": True, "reason": "done", "path_max_m": 0.004 + 0.001 * slope}}
        summary = {"version": "1", "seed": 0, "world": world, "laws": laws}
        (folder / "summary.json").write_text(json.dumps(summary))
        scene = f"[board]\nslope_deg = {slope}\n[errors.gyro]\nbias_rad_s = {slope}\n"
        (folder / "scene.toml").write_text(scene)
        (folder / "preset_qp.toml").write_text(f"law = 'qp'\n[painting]\npush_n = {5.0 + slope}\n")
    return tmp_path / "a", tmp_path / "b"


def test_facts_scene_and_presets_are_compared_key_by_key(runs: tuple[Path, Path]) -> None:
    assert differing_runs(*runs) == [
        {"name": "world", "a": "ideal", "b": "harsh"},
        {"name": "scene.board.slope_deg", "a": 0.0, "b": 2.0},
        {"name": "preset_qp.painting.push_n", "a": 5.0, "b": 7.0},
    ]
    assert differing_runs(runs[0], runs[0]) == []


def test_the_command_names_them_first_and_labels_figures_as_paint_does(
    runs: tuple[Path, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["compare", *map(str, runs)]) == 0
    text = capsys.readouterr().out
    places = [
        text.index(words)
        for words in (
            "flown under other conditions",
            "scene.board.slope_deg",
            "push_n",
            "paint, QP law: completed 1 of 1",
        )
    ]
    assert places == sorted(places)
    assert "world ideal against harsh" in " ".join(text.split())
    assert "path error, largest [mm]" in text and "path_max_m" not in text


def test_presets_differ_in_their_keys() -> None:
    found = differing_presets(FILES["tarot_t960_qp"], FILES["tarot_t960_paper"])
    assert {"name": "preset.law", "a": "qp", "b": "paper"} in found
    gains = {each["name"] for each in found}
    qp, paper = (ibvs_qp.preset(law).controller.gains for law in ("qp", "paper"))
    assert ("preset.controller.gains.line_kp" in gains) == (qp.line_kp != paper.line_kp)
