"""Runs to compare: differing conditions are named first; a summary of unknown origin is read or refused by name."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

import ibvs_qp
from ibvs_qp.pilot.presets import FILES
from sim.commands.cli import main
from sim.report.comparison import differing_presets, differing_runs

LAW = {"completed": True, "reason": "", "push_mean_n": 5.0}
SUMMARY = {"schema": 1, "version": "1", "seed": 3, "world": "ideal", "laws": {"qp": LAW}}


def folder(path: Path, change: dict[str, Any]) -> str:
    path.mkdir()
    (path / "summary.json").write_text(json.dumps(SUMMARY | change))
    return str(path)


def compared(tmp_path: Path, change: dict[str, Any], *words: str) -> int:
    return main(["compare", folder(tmp_path / "a", change), folder(tmp_path / "b", {}), *words])


@pytest.mark.parametrize(
    "change",
    [
        *({"seed": value} for value in (None, "x", [1], 1.5, True, 2**70)),
        *({"version": value} for value in ({}, None, "\ud800", "\x1b[31m")),
        *({"world": value} for value in ({"a": 1}, [], "\x1b[31m")),
        *({"image_size": value} for value in ([640, {}], [[]], 3)),
        *({"laws": {"qp": LAW | {"completed": value}}} for value in ({}, None, "yes")),
        *({"laws": {"qp": LAW | {"reason": value}}} for value in ([], None, 3)),
        *({"laws": value} for value in ({}, [], None, {"qp": None}, {"\x1b[31m": LAW})),
    ],
)
def test_a_value_of_another_type_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], change: dict[str, Any]
) -> None:
    assert compared(tmp_path, change) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.startswith("ibvs-qp: error: ") and err.count("\n") == 1 and "summary.json" in err


@pytest.mark.parametrize("value", [{}, [], 1e308, "x", 10**400, True, None])
def test_a_figure_of_another_type_is_left_out(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], value: object
) -> None:
    law = LAW | {"other": value, "log": 1.0, "seed": 1e308, "push_mean_n.b": 2.0, "param.x": 3}
    assert compared(tmp_path, {"laws": {"qp": law}}, "--json") == 0
    assert set(json.loads(capsys.readouterr().out)["cells"][0]["differences"]) == {"push_mean_n"}


def test_text_has_no_effect_on_the_terminal(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "[").mkdir()
    for name in ("a", "b"):
        run = tmp_path / "[" / f"{name}]"
        folder(run, {"world": f"[/{name}]", "laws": {"[/law]": LAW}})
        (run / "scene.toml").write_text(f'"k[/ey]" = "\\u001b[31m{name}"\n')
    assert main(["compare", *(str(tmp_path / "[" / f"{name}]") for name in ("a", "b"))]) == 0
    out = capsys.readouterr().out
    assert "[/a]" in out and "[/law]" in out and "k[/ey]" in out and "\x1b" not in out


def test_a_broken_scene_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("a", "b"):
        folder(tmp_path / name, {})
        (tmp_path / name / "scene.toml").write_text("= [[")
    assert main(["compare", str(tmp_path / "a"), str(tmp_path / "b")]) == 2
    assert "scene.toml" in capsys.readouterr().err


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
