"""Lines refined in one batch come out as each would alone."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.measurement import RgbdFrame
from ibvs_qp.vision import Perception, VisionConfig
from ibvs_qp.vision.appearance.colors import SurfaceColors
from ibvs_qp.vision.config import LineConfig
from ibvs_qp.vision.lines.query import LineQuery
from ibvs_qp.vision.lines.refine_lines import refine_lines
from ibvs_qp.vision.picture.picture import Picture

FOCAL, SIZE = 600.0, (480, 640)
INTRINSICS = (FOCAL, FOCAL, 319.5, 239.5)
BOARD, PAINT, WALL = (225, 228, 220), (40, 90, 200), (120, 90, 70)
#: Rows and columns between which each thing lies, in order of drawing [px].
TOP, BOTTOM, LEFT, RIGHT, STROKE = 60, 400, 80, 560, 300


def picture() -> Picture:
    """A board with a stroke along its lower part on a wall."""
    rgb = np.empty((*SIZE, 3), np.uint8)
    rgb[:] = WALL
    rgb[TOP:BOTTOM, LEFT:RIGHT] = BOARD
    rgb[STROKE : BOTTOM - 20, LEFT + 20 : RIGHT - 20] = PAINT
    noise = np.random.default_rng(3).normal(0.0, 2.0, rgb.shape)
    rgb = np.clip(cv2.GaussianBlur(rgb, (0, 0), 0.7) + noise, 0, 255).astype(np.uint8)
    return Picture.of(rgb, np.zeros(SIZE, np.uint8), INTRINSICS)


def query(pixel: float, upright: bool, kind: str, side: int, guess_px: float = 2.0) -> LineQuery:
    """A line expected a little beside a border between two pixels."""
    center = INTRINSICS[2] if upright else INTRINSICS[3]
    theta = 0.002 if upright else 0.5 * np.pi + 0.002
    return LineQuery(rho=(pixel - 0.5 + guess_px - center) / FOCAL, theta=theta, kind=kind, surface_side=side)


QUERIES = [
    query(TOP, False, "board", 1),
    query(BOTTOM, False, "board", -1),
    query(LEFT, True, "board", 1),
    query(RIGHT, True, "board", -1),
    query(STROKE, False, "paint", -1),
    query(200, False, "board", 1),  # nothing is there
]
PLACES = [TOP, BOTTOM, LEFT, RIGHT, STROKE]


def refined(queries: list[LineQuery]):
    colors = SurfaceColors(BOARD, PAINT, LineConfig().color_gate)
    return refine_lines(picture(), queries, half_width_px=14.0, config=LineConfig(), colors=colors, contents=True)


def test_batch_equals_lines_alone() -> None:
    together = refined(QUERIES)
    assert together[5] is None
    for line, place, one in zip(together[:5], PLACES, QUERIES, strict=False):
        [alone] = refined([one])
        assert line is not None and alone is not None
        assert (line.rho, line.theta) == pytest.approx((alone.rho, alone.theta), abs=1e-9)
        np.testing.assert_allclose(line.covariance, alone.covariance, rtol=1e-6)
        np.testing.assert_array_equal(line.pixels, alone.pixels)
        assert line.ends == alone.ends
        center = INTRINSICS[2] if abs(np.cos(line.theta)) > 0.5 else INTRINSICS[3]
        assert line.rho * FOCAL + center == pytest.approx(place - 0.5, abs=0.3)


def test_no_queries_and_lines_outside_the_picture() -> None:
    assert refined([]) == []
    assert (
        refined([LineQuery(rho=2.0, theta=0.5 * np.pi), LineQuery(rho=0.0, theta=1.57, span=(3.0, 4.0))]) == [None] * 2
    )


def test_an_edge_that_the_brush_half_hides_is_as_certain_as_what_is_seen_of_it() -> None:
    """A bare board's corner beside the brush, flush with the wall: a fifth of the edge has two free sides."""
    random = np.random.default_rng(5)
    perception = Perception(VisionConfig(), VehicleParams())

    def corner(number: int) -> RgbdFrame:
        rgb = np.full((*SIZE, 3), WALL, np.uint8)
        rgb[:213, :367] = BOARD
        rgb = np.clip(rgb + random.normal(0.0, 2.0, rgb.shape), 0, 255).astype(np.uint8)
        depth = (0.65 * (1.0 + 0.003 * random.standard_normal(SIZE))).astype(np.float32)
        return RgbdFrame(rgb=rgb, depth=depth, intrinsics=INTRINSICS, stamp_ns=1 + 33_000_000 * number)

    level = np.array((1.0, 0.0, 0.0, 0.0))
    seen = [perception.process(corner(number), attitude=level, rotation=np.zeros(3)) for number in range(12)][-1]
    upright = [track for track in seen.tracks if track.role == "vertical"]
    assert len(upright) == 1
    assert upright[0].length_px > 100.0
    assert upright[0].confidence > 0.5
    assert len(seen.features.lines) == 2
