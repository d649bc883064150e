"""Real RGB-D frames with marked lines, where they are present: the board's top edge by detection alone."""

from __future__ import annotations

import csv
import math
import os
from pathlib import Path

import cv2
import numpy as np
import pytest

from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.measurement import RgbdFrame
from ibvs_qp.vision import Perception, VisionConfig
from ibvs_qp.vision.config import PlaneConfig

FOLDER = Path(os.environ.get("IBVS_QP_REAL_FRAMES", Path(__file__).parents[4] / "shared" / "data" / "real_open"))
pytestmark = pytest.mark.skipif(
    not (FOLDER / "manifest.csv").exists(), reason="real frames absent: set IBVS_QP_REAL_FRAMES to their folder"
)
#: A hand-held camera has no arm in view: the tool lies behind it.
HAND_HELD = VehicleParams(camera_position_m=(2.0, 0.0, 0.0))


def rows(name: str) -> list[dict[str, str]]:
    with (FOLDER / name).open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def offset_px(line, marked: dict[str, str], intrinsics: tuple[float, float, float, float]) -> float:
    """Largest distance of the marked end points from a line [px]."""
    fx, fy, cx, cy = intrinsics
    ends = [(float(marked[f"x{k}"]), float(marked[f"y{k}"])) for k in (1, 2)]
    return max(
        fx * abs((u - cx) / fx * math.cos(line.theta) + (v - cy) / fy * math.sin(line.theta) - line.rho)
        for u, v in ends
    )


def test_top_edge_of_the_board_by_detection_alone() -> None:
    frames = [row for row in rows("manifest.csv") if row["color"].startswith("board") and row["seed_u"]]
    marks = {row["color"]: row for row in rows("lines.csv") if row["line"] == "board_top"}
    # hand-held: the board may lean and stand oblique
    config = VisionConfig(plane=PlaneConfig(max_lean_deg=89.0, max_oblique_deg=75.0))
    offsets = []
    for row in frames:
        intrinsics = (float(row["fx"]), float(row["fy"]), float(row["cx"]), float(row["cy"]))
        rgb = cv2.cvtColor(cv2.imread(str(FOLDER / row["color"])), cv2.COLOR_BGR2RGB)
        units = float(row["depth_units_per_m"])
        depth = (cv2.imread(str(FOLDER / row["depth"]), cv2.IMREAD_UNCHANGED) / units).astype(np.float32)
        seed = float(row["seed_u"]), float(row["seed_v"])
        perceived = Perception(config, HAND_HELD).process(
            RgbdFrame(rgb=rgb, depth=depth, intrinsics=intrinsics, stamp_ns=1), seed_pixel=seed
        )
        assert perceived.plane is not None, (row["color"], perceived.refused)
        best = max((c for c in perceived.candidates if c.role == "horizontal"), key=lambda c: c.score)
        offsets.append(offset_px(best.line, marks[row["color"]], intrinsics))
    assert len(offsets) >= 10
    assert sum(offset < 4.0 for offset in offsets) >= len(offsets) - 1, np.round(offsets, 1)
    assert np.median(offsets) < 1.0
