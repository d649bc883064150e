"""``ibvs-qp detect`` on raw pictures: lens, mono, depth of a camera beside, by options and by the manifest."""

from __future__ import annotations

import csv
import functools
import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import tomli_w

from ibvs_qp.vision.picture.camera import Lens
from sim.commands.cli import main
from tests.support.truth import FAMILIES, TruthFrame, render_frame, sample_scene
from tests.support.truth.accuracy import line_errors
from tests.support.truth.devices import ORBBEC

SETTINGS: dict[str, Any] = {
    "distortion": list(ORBBEC.distortion),
    "depth_intrinsics": list(ORBBEC.depth_intrinsics),
    "depth_distortion": list(ORBBEC.depth_distortion),
    "depth_rotation": list(ORBBEC.depth_rotation),
    "depth_translation_m": list(ORBBEC.depth_translation_m),
}


@functools.cache
def truth() -> TruthFrame:
    return render_frame(sample_scene(FAMILIES["orbbec"], 4))


def seed() -> list[str]:
    """The seed in the picture as taken."""
    assert truth().raw is not None
    fx, fy, cx, cy = truth().frame.intrinsics
    ideal = (np.array([truth().seed]) - (cx, cy)) / (fx, fy)
    return [f"{entry:.2f}" for entry in Lens(ORBBEC.distortion).pixels(ideal, truth().frame.intrinsics)[0]]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    raw = truth().raw
    assert raw is not None
    cv2.imwrite(str(tmp_path / "color.png"), cv2.cvtColor(raw.rgb, cv2.COLOR_RGB2BGR))
    cv2.imwrite(str(tmp_path / "grey.png"), cv2.cvtColor(raw.rgb, cv2.COLOR_RGB2GRAY))
    cv2.imwrite(str(tmp_path / "depth.png"), raw.depth)
    np.save(tmp_path / "depth.npy", (1e-3 * raw.depth).astype(np.float32))
    (tmp_path / "camera.toml").write_text(tomli_w.dumps({"camera": SETTINGS | {"depth_units_per_metre": 1000.0}}))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def one(*words: str) -> list[str]:
    camera = [
        f"--{name}={value}" for name, value in zip(("fx", "fy", "cx", "cy"), truth().frame.intrinsics, strict=True)
    ]
    return ["detect", "--seed-pixel", *seed(), *camera, "--json", *words]


def check(capsys: pytest.CaptureFixture[str], words: list[str], most_px: float = 0.5) -> None:
    assert main(words) == 0
    [frame] = json.loads(capsys.readouterr().out)["frames"]
    assert frame["refused"] is None
    lens, intrinsics = Lens(ORBBEC.distortion), truth().frame.intrinsics
    for side, edge in truth().edges.items():
        line = frame["guides"][side]
        assert line is not None, side
        assert line_errors(edge, line["rho"], line["theta"], intrinsics)[0] < most_px
        ends = lens.ideal(np.array([[line["x1"], line["y1"]], [line["x2"], line["y2"]]]), intrinsics)
        across = ends @ (np.cos(line["theta"]), np.sin(line["theta"])) - line["rho"]
        assert np.abs(across).max() * intrinsics[0] < 0.3, "pixels are those of the picture as taken"
    exact = np.linalg.norm(truth().plane)
    assert frame["plane"]["distance_m"] == pytest.approx(1.0 / exact, abs=3e-3)


@pytest.mark.slow
@pytest.mark.parametrize("color", ["color.png", "grey.png"])
def test_depth_of_a_camera_beside_by_a_file(folder: Path, capsys: pytest.CaptureFixture[str], color: str) -> None:
    check(capsys, one("--rgb", color, "--depth", "depth.png", "--camera", "camera.toml"))


def test_float_depth_and_units_of_the_command(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ("--camera", "camera.toml", "--depth-units-per-metre", "1")
    check(capsys, one("--rgb", "color.png", "--depth", "depth.npy", *words))


def table(**more: str) -> str:
    fx, fy, cx, cy = map(str, truth().frame.intrinsics)
    row = {"color": "color.png", "depth": "depth.png", "fx": fx, "fy": fy, "cx": cx, "cy": cy}
    row |= {"depth_units_per_m": "1000"} | dict(zip(("seed_u", "seed_v"), seed(), strict=True))
    row |= {name: " ".join(map(str, numbers)) for name, numbers in SETTINGS.items()} | more
    return "\n".join(",".join(entries) for entries in (row.keys(), row.values())) + "\n"


def test_columns_of_the_manifest(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "manifest.csv").write_text(table())
    assert len(list(csv.reader((folder / "manifest.csv").open()))) == 2
    check(capsys, ["detect", "--sequence", str(folder), "--json"])
    (folder / "manifest.csv").write_text(table(distortion=""))
    check(capsys, ["detect", "--sequence", str(folder), "--camera", "camera.toml", "--json"])


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ({"distortion": "0.1 x"}, "manifest.csv, line 2: distortion = '0.1 x' is refused: numbers separated by blanks"),
        ({"distortion": "0.1 0.2"}, "manifest.csv, line 2: distortion = (0.1, 0.2) is refused: so many coefficients"),
        ({"depth_translation_m": ""}, "manifest.csv, line 2: depth_translation_m is missing"),
        ({"color_bits": "40"}, "manifest.csv, line 2: color_bits = 40 is refused: allowed is [8, 16]"),
    ],
)
def test_a_wrong_column_is_named(
    folder: Path, capsys: pytest.CaptureFixture[str], more: dict[str, str], message: str
) -> None:
    (folder / "manifest.csv").write_text(table(**more))
    assert main(["detect", "--sequence", str(folder)]) == 2
    assert message in " ".join(capsys.readouterr().err.split())


def test_a_file_without_a_camera_and_depth_of_another_size_are_named(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "other.toml").write_text("camera = 3\n")
    assert main(one("--rgb", "color.png", "--camera", "other.toml")) == 2
    assert "other.toml has no [camera]" in capsys.readouterr().err
    cv2.imwrite(str(folder / "small.png"), np.full((100, 120), 900, np.uint16))
    assert main(one("--rgb", "color.png", "--depth", "small.png")) == 2
    assert "depth must be registered to colour, or depth_intrinsics given" in " ".join(capsys.readouterr().err.split())
