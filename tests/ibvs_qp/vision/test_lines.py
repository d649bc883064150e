"""Lines in drawn pictures: in one batch as alone, half hidden, in pictures of any size, with either normal."""

from __future__ import annotations

import dataclasses

import cv2
import numpy as np
import pytest

from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.measurement import RgbdFrame
from ibvs_qp.vision import Perception, VisionConfig
from ibvs_qp.vision.appearance.colors import SurfaceColors
from ibvs_qp.vision.config import LineConfig
from ibvs_qp.vision.lines.refine import LineFits
from ibvs_qp.vision.lines.tracks import LineTracker, TrackState
from ibvs_qp.vision.picture.layout import PictureLayout
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
    frame = RgbdFrame(rgb=rgb, depth=np.zeros(SIZE, np.float32), intrinsics=INTRINSICS, stamp_ns=0)
    return Picture(frame, PictureLayout(frame, VisionConfig(), None))


FITS = LineFits(LineConfig(), SurfaceColors(BOARD, PAINT, LineConfig().color_gate))


def query(pixel: float, upright: bool, kind: str, side: int, guess_px: float = 2.0) -> tuple[object, ...]:
    """A line expected a little beside a border between two pixels."""
    center = INTRINSICS[2] if upright else INTRINSICS[3]
    theta = 0.002 if upright else 0.5 * np.pi + 0.002
    return FITS.query((pixel - 0.5 + guess_px - center) / FOCAL, theta, kind=kind, surface_side=side)


QUERIES = [
    query(TOP, False, "board", 1),
    query(BOTTOM, False, "board", -1),
    query(LEFT, True, "board", 1),
    query(RIGHT, True, "board", -1),
    query(STROKE, False, "paint", -1),
    query(200, False, "board", 1),  # nothing is there
]
PLACES = [TOP, BOTTOM, LEFT, RIGHT, STROKE]


def refined(queries: list[tuple[object, ...]]):
    return FITS.fit_lines(picture(), queries, 14.0, contents=True)


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
    assert refined([FITS.query(2.0, 0.5 * np.pi), FITS.query(0.0, 1.57, span=(3.0, 4.0))]) == [None] * 2


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
    assert upright[0].line.length_px > 100.0
    assert upright[0].confidence > 0.5
    assert len(seen.features.lines) == 2


SIZES = [(480, 640), (480, 848), (480, 720), (768, 1024), (1080, 1920), (481, 641), (1536, 2048)]


@pytest.mark.parametrize("size", SIZES)
def test_all_four_edges_are_found_in_pictures_of_any_size(size: tuple[int, int]) -> None:
    """The cells of the coarse grid have 8, 11, 9, 13, 24 and 26 pixels, the searched picture has half of them."""
    random, (height, width) = np.random.default_rng(6), size
    rgb = np.full((*size, 3), WALL, np.uint8)
    depth = np.full(size, 0.80, np.float32)
    places = {"top": height // 8, "bottom": height * 7 // 8, "left": width // 8, "right": width * 15 // 16}
    inside = slice(places["top"], places["bottom"]), slice(places["left"], places["right"])
    rgb[inside], depth[inside] = BOARD, 0.65
    rgb = np.clip(cv2.GaussianBlur(rgb, (0, 0), 0.7) + random.normal(0.0, 2.0, rgb.shape), 0, 255).astype(np.uint8)
    depth *= (1.0 + 0.002 * random.standard_normal(size)).astype(np.float32)
    intrinsics = (0.9 * width, 0.9 * width, 0.5 * (width - 1), 0.5 * (height - 1))
    frame = RgbdFrame(rgb=rgb, depth=depth, intrinsics=intrinsics, stamp_ns=1)
    seen = Perception(VisionConfig(), None).process(frame, detect=True, seed_pixel=(0.5 * width, 0.5 * height))
    for side, place in places.items():
        guide = seen.guides[side]
        assert guide is not None, side
        upright = side in ("left", "right")
        sign = np.cos(guide.theta) if upright else np.sin(guide.theta)
        found = sign * guide.rho * intrinsics[0] + intrinsics[2 if upright else 3]
        assert found == pytest.approx(place - 0.5, abs=0.3), side


def test_a_line_fitted_with_the_other_normal_leaves_a_track_as_it_is() -> None:
    [line] = refined([query(TOP, False, "board", 1)])
    assert line is not None
    track = TrackState(
        track_id=1,
        line=line,
        role="horizontal",
        kind="board",
        surface_side=1,
        score=0.9,
        certainty=0.9,
        borders_plane=True,
    )
    track.adopt(line)
    before = track.rho, track.theta, track.step.tolist(), track.covariance.tolist()
    turned = dataclasses.replace(
        line,
        rho=-line.rho,
        theta=line.theta - np.pi,
        step=-line.step,
        covariance=line.covariance * np.array([[1.0, -1.0], [-1.0, 1.0]]),
    )
    track.adopt(turned)
    assert (track.rho, track.theta) == pytest.approx(before[:2])
    assert track.step.tolist() == pytest.approx(before[2]) and track.covariance.tolist() == before[3]


def test_light_is_forgotten_with_the_size_of_the_picture_and_identities_go_on(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its cells would be read out of bounds; an identity means one line."""
    perception, stamp = Perception(VisionConfig(board_color=BOARD), None), 0
    seen, widths = [], []

    def follow_hints(self: LineTracker, hints: object, picture: Picture, *more: object) -> None:
        """The first search after a change: what the light's cells are then."""
        light = perception._colors.light
        widths.append((picture.mask.shape[1], None if light is None else 16 * light.levels.shape[1]))

    monkeypatch.setattr(LineTracker, "follow_hints", follow_hints)
    for half in (False,) * 3 + (True,) * 7 + (False,) * 7:
        stamp += 33_000_000
        frame = shaded(stamp)
        if half:
            frame = RgbdFrame(
                rgb=frame.rgb[::2, ::2].copy(),
                depth=frame.depth[::2, ::2].copy(),
                intrinsics=(300.0, 300.0, 159.75, 119.75),
                stamp_ns=stamp,
            )
        width = frame.rgb.shape[1]
        seen.append(perception.process(frame, seed_pixel=(0.5 * width, 0.4 * width)))
    of_size = [{track.track_id for track in found.tracks} for found in (seen[2], seen[9], seen[16])]
    assert all(of_size)
    assert {(640, 640), (320, 320)} <= set(widths) and all(light in (None, width) for width, light in widths)
    assert not of_size[0] & of_size[1] and not (of_size[0] | of_size[1]) & of_size[2]


def test_the_turn_over_a_refused_picture_is_not_lost() -> None:
    """A yaw to the right by 18 px while a picture was refused: more than the strip in which a line is searched."""
    perception, turn = Perception(VisionConfig(), None), 18.0 / FOCAL
    for number in range(4):
        perception.process(shaded(1 + 33_000_000 * number), rotation=np.zeros(3), seed_pixel=(320.0, 200.0))
    broken = dataclasses.replace(shaded(1 + 33_000_000 * 4), rgb=np.zeros((4, 4, 3), np.uint8))
    assert perception.process(broken, rotation=np.array((0.0, 0.0, turn))).refused
    after = shaded(1 + 33_000_000 * 5)
    moved = dataclasses.replace(
        after, rgb=np.roll(after.rgb, -18, axis=1).copy(), depth=np.roll(after.depth, -18, axis=1).copy()
    )
    seen = perception.process(moved, rotation=np.zeros(3), seed_pixel=(302.0, 200.0))
    upright = [track for track in seen.tracks if track.role == "vertical" and track.confirmed]
    assert len(upright) == 2 and all(track.seen for track in upright)


def shaded(stamp_ns: int) -> RgbdFrame:
    """The board of `picture` without paint, lit from the left."""
    rgb = np.empty((*SIZE, 3), np.uint8)
    rgb[:] = WALL
    rgb[TOP:BOTTOM, LEFT:RIGHT] = BOARD
    light = np.linspace(1.0, 0.7, SIZE[1])[None, :, None]
    noise = np.random.default_rng(stamp_ns).normal(0.0, 2.0, rgb.shape)
    depth = np.full(SIZE, 0.9, np.float32)
    depth[TOP:BOTTOM, LEFT:RIGHT] = 0.7
    lit = np.clip(rgb * light + noise, 0, 255).astype(np.uint8)
    return RgbdFrame(rgb=lit, depth=depth, intrinsics=INTRINSICS, stamp_ns=stamp_ns)
