"""The pilot's perception on real RGB-D frames with marked lines, where they are present."""

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

FOLDER = Path(os.environ.get("IBVS_QP_REAL_FRAMES", Path(__file__).parents[4] / "shared" / "data" / "real_open"))
pytestmark = pytest.mark.skipif(
    not (FOLDER / "manifest.csv").exists(), reason="real frames absent: set IBVS_QP_REAL_FRAMES to their folder"
)
#: A hand-held camera has no arm in view: the tool lies behind it.
HAND_HELD = VehicleParams(camera_position_m=(2.0, 0.0, 0.0))
#: Between two pictures of the sequence.
PERIOD_NS = 33_333_333


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


def angle_deg(line, marked: dict[str, str]) -> float:
    """Angle between a line and the marked one [deg]."""
    return math.degrees(abs(math.remainder(line.theta - float(marked["theta_rad"]), math.pi)))


def picture(row: dict[str, str], stamp_ns: int) -> RgbdFrame:
    """A frame of the manifest."""
    rgb = cv2.cvtColor(cv2.imread(str(FOLDER / row["color"])), cv2.COLOR_BGR2RGB)
    depth = cv2.imread(str(FOLDER / row["depth"]), cv2.IMREAD_UNCHANGED) / float(row["depth_units_per_m"])
    intrinsics = (float(row["fx"]), float(row["fy"]), float(row["cx"]), float(row["cy"]))
    return RgbdFrame(rgb=rgb, depth=depth.astype(np.float32), intrinsics=intrinsics, stamp_ns=stamp_ns)


@pytest.mark.parametrize("followed", [False, True])
def test_top_and_right_edge_of_the_board_without_gyro_and_attitude(followed: bool) -> None:
    frames = [row for row in rows("manifest.csv") if row["color"].startswith("board") and row["seed_u"]]
    marks = {(row["color"], row["line"]): row for row in rows("lines.csv")}
    perception, offsets = Perception(VisionConfig(), HAND_HELD), {"top": [], "right": []}
    for number, row in enumerate(frames):
        if not followed:
            perception.reset()
        seed = None if followed and number else (float(row["seed_u"]), float(row["seed_v"]))
        frame = picture(row, (number + 1) * PERIOD_NS)
        perceived = perception.process(frame, seed_pixel=seed, detect=not followed)
        assert perceived.plane is not None, (row["color"], perceived.refused)
        for side, found in offsets.items():
            guide, marked = perceived.guides[side], marks[row["color"], f"board_{side}"]
            assert guide is not None and angle_deg(guide, marked) < 2.0, (row["color"], side)
            assert not followed or number == 0 or guide.confirmed
            found.append(offset_px(guide, marked, frame.intrinsics))
    assert len(frames) >= 10
    for side, found in offsets.items():
        assert max(found) < 4.0 and np.median(found) < 0.5, (side, np.round(found, 2))
