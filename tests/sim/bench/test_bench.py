"""`ibvs-qp bench` vision, qp and loop: rows, counts, ratios, rejected options and folders."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from ibvs_qp.config.errors import IbvsQpError
from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.vision import checks
from sim.bench import loop
from sim.bench.ticks import recorded_ticks
from sim.bench.timing import DEADLINES_HZ, Row
from sim.bench.vision import bench_vision, mission_shots
from sim.commands.cli import main
from sim.world.scene import Scene

FRAMES = 24
NAMES = {"tracked_frame", "detection", "velocity", "whole_frame", "paper", "lsd"}


def write_folder(folder: Path, **changes: str) -> None:
    """A folder of one rendered frame with the manifest's columns."""
    shot = next(mission_shots((424, 240), 20, 0, VehicleParams()))
    cv2.imwrite(str(folder / "a_color.png"), shot.frame.rgb[..., ::-1])
    cv2.imwrite(str(folder / "a_depth.png"), np.round(shot.frame.depth * 1000.0).astype(np.uint16))
    fx, fy, cx, cy = shot.frame.intrinsics
    row = {"color": "a_color.png", "depth": "a_depth.png", "fx": fx, "fy": fy, "cx": cx, "cy": cy}
    row |= {"depth_units_per_m": 1000, "seed_u": 330, "seed_v": 40, **changes}
    with (folder / "manifest.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, list(row))
        writer.writeheader()
        writer.writerow(row)


@pytest.mark.slow
def test_one_json_line_with_rows_stages_and_ratios(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    write_folder(tmp_path)
    clock = checks.stage_time
    assert main(["bench", "vision", "--frames", str(FRAMES), "--real", str(tmp_path), "--json"]) == 0
    assert checks.stage_time is clock, "flights measure wall-clock time"
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 1
    bench = json.loads(lines[0])
    assert bench["schema"] == 1 and set(bench) == {"schema", "rows", "stages_us", "ratios"}
    assert {row["name"] for row in bench["rows"] if row["size"] == "640x480"} == NAMES
    assert {row["name"] for row in bench["rows"] if row["size"] == "424x240"} == NAMES | {f"{n}_real" for n in NAMES}
    rows = {(row["name"], row["size"]): row for row in bench["rows"]}
    for row in bench["rows"]:
        if row["name"] not in ("tracked_frame_real", "velocity_real"):  # one still frame: nothing moves
            assert 0.0 < row["p50_us"] <= row["p90_us"] <= row["p99_us"] <= row["p999_us"] <= row["max_us"], row["name"]
            assert set(row["misses"]) == {"250", "500", "1000"}
    ours, paper = rows["tracked_frame", "640x480"]["p50_us"], rows["paper", "640x480"]["p50_us"]
    assert bench["ratios"]["track_vs_paper"] == pytest.approx(paper / ours)
    assert bench["ratios"]["detect_vs_paper"] == pytest.approx(paper / rows["detection", "640x480"]["p50_us"])
    assert {"plane", "tracks", "flow", "detection_detect", "paper_normals"} <= set(bench["stages_us"])


def test_pictures_of_the_mission_are_seeded_and_show_paint() -> None:
    shots = [list(mission_shots((424, 240), FRAMES, seed, VehicleParams())) for seed in (0, 0, 1)]
    assert [len(run) for run in shots] == [FRAMES] * 3
    for one, two in zip(shots[0], shots[1], strict=True):
        assert np.array_equal(one.frame.rgb, two.frame.rgb) and np.array_equal(one.rotation, two.rotation)
    assert not np.array_equal(shots[0][5].frame.rgb, shots[2][5].frame.rgb)
    paint = np.array(Scene().paint.color)
    painted = [int((np.abs(shot.frame.rgb - paint).max(axis=2) < 25).sum()) for shot in shots[0]]
    assert painted[-1] > painted[0] + 1000


def test_a_row_records_times_and_missed_deadlines() -> None:
    row = Row(name="sleep", size=None)
    assert row.measure(lambda: 7) == 7 and len(row.times_us) == 1
    row = Row(name="given", times_us=[900.0, 1100.0, 2100.0, 4100.0])
    figures = row.summary()
    assert figures["p50_us"] == pytest.approx(1600.0) and figures["max_us"] == 4100.0
    assert figures["misses"] == {str(rate): misses for rate, misses in zip(DEADLINES_HZ, (1, 2, 3), strict=True)}


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"color": "gone.png"}, "cannot read the colour picture"),
        ({"fx": "wide"}, "line 2"),
        ({"depth_units_per_m": "0"}, "a number above 0 is needed"),
    ],
)
def test_a_folder_that_cannot_be_used_is_refused(tmp_path: Path, changes: dict[str, str], words: str) -> None:
    write_folder(tmp_path, **changes)
    with pytest.raises(IbvsQpError, match=words):
        bench_vision(20, 0, tmp_path, lambda _: None, sizes=())


def test_an_unusable_option_is_one_line(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    assert main(["bench", "vision", "--frames", "3"]) == 2
    assert "--frames = 3 is refused" in capsys.readouterr().err
    assert main(["bench", "vision", "--real", str(tmp_path)]) == 2
    assert "manifest.csv: No such file" in capsys.readouterr().err
    assert main(["bench"]) == 2


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


def test_ticks_are_those_of_a_flight() -> None:
    ticks = recorded_ticks(1500, seed=0)
    stamps = np.array([measurement.stamp_ns for measurement, _ in ticks])
    assert len(ticks) == 1500 and (np.diff(stamps) == 4_000_000).all()
    assert any(measurement.lines for measurement, _ in ticks)


def test_bench_qp_as_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bench", "qp", "--ticks", "1200", "--sample", "60", "--json"]) == 0
    table = json.loads(capsys.readouterr().out)
    rows = {row["name"]: row for row in table["rows"]}
    assert table["schema"] == 1 and {
        "step",
        "step_interpreted",
        "qpsolvers_osqp",
        "qpsolvers_assembly",
        "casadi_daqp",
    } <= set(rows)
    assert set(rows["step"]) == {"name", "size", "p50_us", "p90_us", "p99_us", "p999_us", "max_us", "misses"}
    assert set(table["stages_us"]) == {"pack", "evaluate", "solve", "explain"}
    assert table["ratios"]["qpsolvers_osqp"] > 1.0
    assert rows["qpsolvers_assembly"]["p50_us"] < rows["qpsolvers_osqp"]["p50_us"]
    kinds = [*table["row_kinds"], "step_interpreted", "mink_12_joints"]
    assert all(any(name == kind or name.startswith(kind.removesuffix("NAME")) for kind in kinds) for name in rows)
    assert sum(table["outcomes"].values()) == table["ticks"] == 1200
    assert table["osqp_iterates_share"] == 1.0 and "0" not in table["iterations"]
    assert table["difference_to_exact_n"]["max"] < 2e-2
    assert table["difference_to_exact_unlimited_n"]["max"] < 1e-3


@pytest.mark.parametrize("words", [["--ticks", "5"], ["--sample", "0"]])
def test_bench_qp_refuses_nonsense_in_one_line(words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bench", "qp", *words]) == 2
    said = capsys.readouterr().err
    assert words[0] in said and said.count("\n") == 1
