"""``ibvs-qp detect``: contract of its JSON, files of every kind, refusals by name, errors in one line."""

from __future__ import annotations

import csv
import functools
import json
import math

import cv2
import numpy as np
import pytest
from contract_schema import refusal

from sim.commands.cli import main
from sim.detection.manifest import FrameEntry, motion_sequences
from tests.support.truth import FAMILIES, TruthFrame, render_frame, sample_scene
from tests.support.truth.accuracy import line_errors

LINE = {"x1", "y1", "x2", "y2", "rho", "theta", "covariance", "score", "confidence", "length_px", "borders_plane", "id"}
FRAME = {"color", "depth", "method", "refused", "plane", "candidates", "guides", "tracked", "time_ms"}
PLANE = {"abcd", "normal", "distance_m", "inlier_share", "covariance"}
SIDES = {"top", "bottom", "left", "right"}


@functools.cache
def truth() -> TruthFrame:
    return render_frame(sample_scene(FAMILIES["near wall"], 1))


def save(folder, name: str = "x") -> tuple[str, str]:
    frame = truth().frame
    color, depth = folder / f"{name}_color.png", folder / f"{name}_depth.png"
    cv2.imwrite(str(color), cv2.cvtColor(frame.rgb, cv2.COLOR_RGB2BGR))
    cv2.imwrite(str(depth), np.rint(frame.depth * 5000.0).astype(np.uint16))
    return str(color), str(depth)


def single(color: str, depth: str | None, *more: str, units: str = "5000", seed: bool = True) -> list[str]:
    camera = [
        f"--{name}={value}" for name, value in zip(("fx", "fy", "cx", "cy"), truth().frame.intrinsics, strict=True)
    ]
    words = ["detect", "--rgb", color, *camera, "--depth-units-per-metre", units, *more]
    words += ["--depth", depth] if depth else []
    return words + (["--seed-pixel", *(str(value) for value in truth().seed)] if seed else [])


def seen(capsys, words: list[str]) -> dict:
    assert main([*words, "--json"]) == 0
    out, err = capsys.readouterr()
    assert err == "" and out.count("\n") == 1
    content = json.loads(out)
    assert content["schema"] == 1
    for frame in content["frames"]:
        check_frame(frame)
    return content


def check_frame(frame: dict) -> None:
    assert set(frame) == FRAME and set(frame["guides"]) == SIDES
    assert frame["refused"] is None or frame["refused"]
    assert (frame["plane"] is None) == (frame["refused"] is not None)
    if frame["plane"] is None:
        assert all(guide is None for guide in frame["guides"].values())
    else:
        assert set(frame["plane"]) == PLANE and frame["plane"]["abcd"][3] == -1.0
        assert np.linalg.norm(frame["plane"]["normal"]) == pytest.approx(1.0) and frame["plane"]["normal"][2] < 0.0
        assert np.array(frame["plane"]["covariance"]).shape == (3, 3)
    for line in [*frame["candidates"], *(guide for guide in frame["guides"].values() if guide)]:
        assert set(line) == LINE and 0.0 <= line["confidence"] <= 1.0 and 0.0 <= line["score"] <= 1.0
        assert line["length_px"] == pytest.approx(math.hypot(line["x2"] - line["x1"], line["y2"] - line["y1"]))
        assert np.array(line["covariance"]).shape == (2, 2)
        fx, fy, cx, cy = truth().frame.intrinsics
        for u, v in ((line["x1"], line["y1"]), (line["x2"], line["y2"])):
            across = (u - cx) / fx * math.cos(line["theta"]) + (v - cy) / fy * math.sin(line["theta"]) - line["rho"]
            assert abs(across) * fx < 1.0


def test_single_frame(tmp_path, capsys) -> None:
    [frame] = seen(capsys, single(*save(tmp_path)))["frames"]
    assert frame["method"] == "own" and frame["refused"] is None and not frame["tracked"]
    for side, edge in truth().edges.items():
        guide = frame["guides"][side]
        assert guide is not None and guide["confidence"] >= 0.8 and guide["borders_plane"]
        assert line_errors(edge, guide["rho"], guide["theta"], truth().frame.intrinsics)[2] < 0.5
        assert guide["id"] in {line["id"] for line in frame["candidates"]}


def test_the_papers_pipeline_answers_in_the_same_form(tmp_path, capsys) -> None:
    [frame] = seen(capsys, single(*save(tmp_path), "--method", "paper"))["frames"]
    assert frame["method"] == "paper" and frame["refused"] is None and frame["candidates"]
    assert frame["guides"]["bottom"] is None, "it knows a topmost line and a first upright one"
    top = frame["guides"]["top"]
    assert top is not None and top["confidence"] < 0.8 and top["id"] in {line["id"] for line in frame["candidates"]}


def test_all_lists_lines_of_the_whole_picture_and_leaves_the_guides(tmp_path, capsys) -> None:
    files = save(tmp_path)
    [few], [many] = (seen(capsys, single(*files, *more))["frames"] for more in ((), ("--all",)))
    assert few["guides"] == many["guides"]
    assert len(many["candidates"]) > len(few["candidates"]) + 20
    assert len({line["id"] for line in many["candidates"]}) == len(many["candidates"])


def test_without_seed_or_depth_lines_remain(tmp_path, capsys) -> None:
    color, depth = save(tmp_path)
    for words in (single(color, depth, seed=False), single(color, None)):
        [frame] = seen(capsys, words)["frames"]
        assert frame["refused"] and len(frame["candidates"]) > 20


def test_refusals_name_the_reason(tmp_path, capsys) -> None:
    color, depth = save(tmp_path)
    [frame] = seen(capsys, single(color, depth, units="1"))["frames"]
    assert "millimetres" in frame["refused"]
    [frame] = seen(capsys, [*single(color, depth, seed=False), "--seed-pixel", "5000", "10"])["frames"]
    assert "outside" in frame["refused"]
    empty = tmp_path / "empty.png"
    cv2.imwrite(str(empty), np.zeros(truth().frame.depth.shape, np.uint16))
    [frame] = seen(capsys, single(color, str(empty)))["frames"]
    assert "no valid reading" in frame["refused"]
    holed = truth().frame.depth.copy()
    u, v = (round(value) for value in truth().seed)
    holed[v - 40 : v + 40, u - 40 : u + 40] = 0.0
    np.save(tmp_path / "holed.npy", holed)
    [frame] = seen(capsys, single(color, str(tmp_path / "holed.npy"), units="1"))["frames"]
    assert "around the seed" in frame["refused"]


@pytest.mark.parametrize("kind", ["float tiff", "npy", "npz", "8 bit", "16 bit colour", "grey"])
def test_files_of_every_kind(tmp_path, capsys, kind: str) -> None:
    frame, (color, depth), units = truth().frame, save(tmp_path), "1"
    if kind == "float tiff":
        depth = str(tmp_path / "d.tiff")
        cv2.imwrite(depth, frame.depth)
    elif kind == "npy":
        depth = str(tmp_path / "d.npy")
        np.save(depth, frame.depth)
    elif kind == "npz":
        depth = str(tmp_path / "d.npz")
        np.savez(depth, depth=frame.depth)
    elif kind == "8 bit":  # 6 mm steps
        depth, units = str(tmp_path / "d8.png"), "160"
        cv2.imwrite(depth, np.clip(np.rint(frame.depth * 160.0), 0, 255).astype(np.uint8))
    elif kind == "16 bit colour":
        color, units = str(tmp_path / "c16.png"), "5000"
        cv2.imwrite(color, cv2.cvtColor(frame.rgb, cv2.COLOR_RGB2BGR).astype(np.uint16) * 257)
    else:
        color, units = str(tmp_path / "g.png"), "5000"
        cv2.imwrite(color, cv2.cvtColor(frame.rgb, cv2.COLOR_RGB2GRAY))
    [result] = seen(capsys, single(color, depth, units=units))["frames"]
    assert result["refused"] is None
    right = 0
    for side, edge in truth().edges.items():
        guide = result["guides"][side]
        right += guide is not None and line_errors(edge, guide["rho"], guide["theta"], frame.intrinsics)[2] < 4.0
    assert right == len(truth().edges)


def fails(capsys, words: list[str], *parts: str) -> None:
    err = refusal(words, capsys)
    for part in parts:
        assert part in err, err


def test_user_errors_are_one_line(tmp_path, capsys) -> None:
    color, depth = save(tmp_path)
    fails(capsys, ["detect"], "--rgb", "--sequence")
    fails(capsys, ["detect", "--rgb", color], "--fx")
    fails(capsys, single(str(tmp_path / "none.png"), depth), "none.png")
    (tmp_path / "text.png").write_text("no picture")
    fails(capsys, single(str(tmp_path / "text.png"), depth), "text.png", "no picture")
    small = tmp_path / "small.png"
    cv2.imwrite(str(small), np.zeros((100, 120), np.uint16))
    fails(capsys, single(color, str(small)), "120 x 100", "640 x 480")
    fails(capsys, single(color, color), "channels")
    fails(capsys, single(color, depth, units="0"), "--depth-units-per-metre")
    fails(capsys, single(color, depth, "--track", "--no-track"), "--no-track")
    fails(capsys, single(color, depth, "--method", "magic"), "--method")
    fails(capsys, ["detect", "--sequence", str(tmp_path)], "manifest.csv")
    (tmp_path / "manifest.csv").write_text("color,depth\na,b\n")
    fails(capsys, ["detect", "--sequence", str(tmp_path)], "'fx'")
    (tmp_path / "file").write_text("")
    fails(capsys, single(color, depth, "--overlay", str(tmp_path / "file")), "--overlay")


def write_manifest(folder, rows: list[dict]) -> None:
    fx, fy, cx, cy = truth().frame.intrinsics
    u, v = truth().seed
    base = {"fx": fx, "fy": fy, "cx": cx, "cy": cy, "depth_units_per_m": 5000, "seed_u": u, "seed_v": v, "note": "x"}
    full = [{**base, **row} for row in rows]
    with (folder / "manifest.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, list(full[0]))
        writer.writeheader()
        writer.writerows(full)


def test_folder_with_a_motion_sequence_and_overlays(tmp_path, capsys) -> None:
    for name in ("board_0007", "board_0008", "board_0010", "alone"):
        save(tmp_path, name)
    rows = [{"color": f"{n}_color.png", "depth": f"{n}_depth.png"} for n in ("board_0008", "alone", "board_0007")]
    rows += [
        {"color": "board_0010_color.png", "depth": "board_0010_depth.png", "seed_u": "", "seed_v": ""},
        {"color": "board_0011_color.png", "depth": ""},
    ]
    write_manifest(tmp_path, rows)
    words = ["detect", "--sequence", str(tmp_path)]
    frames = seen(capsys, [*words, "--overlay", str(tmp_path / "out")])["frames"]
    assert [frame["color"] for frame in frames] == [row["color"] for row in rows]
    assert [frame["tracked"] for frame in frames] == [True, False, False, False, False]
    assert frames[3]["refused"] and frames[3]["candidates"]
    assert "board_0011_color.png" in frames[4]["refused"] and not frames[4]["candidates"]
    for side in SIDES:
        assert frames[0]["guides"][side]["id"] == frames[2]["guides"][side]["id"]
    drawn = {path.name: cv2.imread(str(path)) for path in (tmp_path / "out").iterdir()}
    assert len(drawn) == 4 and all(picture.shape == (480, 640, 3) for picture in drawn.values())
    assert not any(frame["tracked"] for frame in seen(capsys, [*words, "--no-track"])["frames"])
    assert main(words) == 0
    out, _ = capsys.readouterr()
    assert "top" in out and "no seed pixel" in out


def test_numbers_that_follow_on_make_a_sequence() -> None:
    def entry(name: str) -> FrameEntry:
        return FrameEntry(
            color=name, depth="", folder=None, intrinsics=(1.0, 1.0, 0.0, 0.0), depth_units_per_metre=1.0, seed=None
        )  # type: ignore[arg-type]

    names = ["a_0009_color.png", "b_0010_color.png", "a_0010_color.png", "c.png", "a_0012_color.png", "a_011_color.jpg"]
    groups = motion_sequences([entry(name) for name in names])
    assert sorted(map(tuple, groups)) == [(0, 2, 5, 4), (1,), (3,)]


def test_help_loads_nothing_heavy_and_offers_only_what_works(capsys) -> None:
    assert main(["detect", "--help"]) == 0
    out = capsys.readouterr().out
    assert "Example: ibvs-qp detect" in out
