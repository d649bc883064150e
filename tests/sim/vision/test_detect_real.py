"""The detector of `ibvs-qp detect` on real RGB-D frames with marked lines, where they are present."""

from __future__ import annotations

import csv
import json
import math
import os
from pathlib import Path

import numpy as np
import pytest

from sim.commands.cli import main

FOLDER = Path(os.environ.get("IBVS_QP_REAL_FRAMES", Path(__file__).parents[4] / "shared" / "data" / "real_open"))
pytestmark = pytest.mark.skipif(
    not (FOLDER / "manifest.csv").exists(), reason="real frames absent: set IBVS_QP_REAL_FRAMES to their folder"
)
#: Frames looked at while thresholds were chosen; the figures must hold for the others alone, too.
LOOKED_AT = {f"board_{number:04d}_color.png" for number in (20, 24, 27, 28, 29)}
MATCH_PX, MATCH_DEG = 4.0, 2.0


def rows(name: str) -> list[dict[str, str]]:
    with (FOLDER / name).open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def errors(line: dict, marked: dict[str, str], camera: dict[str, str]) -> tuple[float, float]:
    """Largest distance of the marked ends from a line [px] and its angle error [deg]."""
    fx, fy, cx, cy = (float(camera[name]) for name in ("fx", "fy", "cx", "cy"))
    across = [
        (float(marked[f"x{k}"]) - cx) / fx * math.cos(line["theta"])
        + (float(marked[f"y{k}"]) - cy) / fy * math.sin(line["theta"])
        - line["rho"]
        for k in (1, 2)
    ]
    angle = math.degrees(abs(math.remainder(line["theta"] - float(marked["theta_rad"]), math.pi)))
    return fx * max(map(abs, across)), angle


def right(line: dict, marked: dict[str, str], camera: dict[str, str]) -> bool:
    offset, angle = errors(line, marked, camera)
    return offset < MATCH_PX and angle < MATCH_DEG


@pytest.mark.parametrize("mode", ["--no-track", "--track"])
def test_marked_lines_and_guides(mode: str, capsys) -> None:
    assert main(["detect", "--sequence", str(FOLDER), "--all", "--json", mode]) == 0
    frames = {frame["color"]: frame for frame in json.loads(capsys.readouterr().out)["frames"]}
    cameras, marks = {row["color"]: row for row in rows("manifest.csv")}, rows("lines.csv")
    for skipped in (set(), LOOKED_AT):
        used = [mark for mark in marks if mark["color"] not in skipped]
        seen = [
            any(right(line, mark, cameras[mark["color"]]) for line in frames[mark["color"]]["candidates"])
            for mark in used
        ]
        assert all(seen)
        for side in ("top", "right"):
            boards = [mark for mark in used if mark["line"] == f"board_{side}"]
            offsets = []
            for mark in boards:
                guide, camera = frames[mark["color"]]["guides"][side], cameras[mark["color"]]
                assert guide is not None and right(guide, mark, camera), (mark["color"], side)
                offsets.append(errors(guide, mark, camera)[0])
            assert np.median(offsets) <= 0.5
    for name, camera in cameras.items():
        if not camera["seed_u"]:
            assert all(guide is None for guide in frames[name]["guides"].values())
