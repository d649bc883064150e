"""Light that falls unevenly on the board, and exposures other than the one in which the paint's colour was named."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from rendered_scenes import Flight, World, board_edge, row_edge, scene_of, stroke_row

from ibvs_qp.measurement import RgbdFrame
from ibvs_qp.vision.appearance.colors import LIGHT_STEP
from ibvs_qp.vision.appearance.light import CELL_BITS, LightField, fit_light, products

FRAMES, SETTLE = 14, 8
#: Exposure that keeps a white board in 1.4 times the light below white.
EXPOSURE = 0.8
INTRINSICS, SHAPE, GATE = (625.2, 625.2, 319.5, 239.5), (480, 640), 42.0
WHITE = np.array([228.0, 230.0, 222.0], np.float32)


def light_of(kind: str, share: float, shape: tuple[int, int]) -> np.ndarray:
    """Light over a picture that changes by +-share, float (H, W, 1)."""
    height, width = shape
    x, y = np.meshgrid(np.linspace(-1.0, 1.0, width), np.linspace(-1.0, 1.0, height))
    radius = (x**2 * (width / height) ** 2 + y**2) / ((width / height) ** 2 + 1.0)
    change = {"left-right": x, "top-bottom": y, "vignette": 1.0 - 2.0 * radius}[kind]
    return (1.0 + share * change)[..., None]


class Lit:
    """A camera in uneven light."""

    def __init__(self, camera, kind: str, share: float, exposure: float = EXPOSURE) -> None:
        self._camera, self._kind, self._share, self._exposure = camera, kind, share, exposure

    def capture(self, *arguments) -> RgbdFrame:
        frame = self._camera.capture(*arguments)
        light = self._exposure * light_of(self._kind, self._share, frame.depth.shape)
        return dataclasses.replace(frame, rgb=np.clip(np.rint(frame.rgb * light), 0, 255).astype(np.uint8))


def row_1(scene: str, kind: str, share: float, exposure: float = EXPOSURE) -> tuple[World, float, Flight]:
    """A board with half of row 1 painted, seen through a lit camera."""
    world = World(scene_of(scene), 2)
    world.camera = Lit(world.camera, kind, share, exposure)  # type: ignore[assignment]
    right = world.geometry.row_ends[1]
    stroke_row(world, 1, right, right - 0.3)
    lines = {"bottom": board_edge(world, "bottom"), "fresh": row_edge(world, 1, 1)}
    return world, right - 0.3, Flight(world, lines, settle=SETTLE)


KINDS = ("left-right", "top-bottom", "vignette")
CASES = [
    *[("default", kind, share) for kind in KINDS for share in (0.1, -0.25, 0.4, -0.4)],
    *[("dark_board", kind, 0.4) for kind in KINDS],
    *[("low_contrast", kind, share) for kind in KINDS for share in (0.4, -0.4)],
    ("low_contrast", "left-right", 0.25),
]


@pytest.mark.slow
@pytest.mark.parametrize(("scene", "kind", "share"), CASES)
def test_edges_of_board_and_paint_are_seen_in_uneven_light(scene: str, kind: str, share: float) -> None:
    world, start, flight = row_1(scene, kind, share)
    path = start - 0.1 / 30.0 * np.arange(FRAMES)
    flight.run(path, world.geometry.row_height(1), np.zeros(FRAMES), 2, 1)
    assert flight.false == 0
    for score in flight.scores.values():
        score.check()


@pytest.mark.parametrize("exposure", [0.6, 0.8, 1.1])
def test_paint_is_known_in_other_exposures(exposure: float) -> None:
    world, start, flight = row_1("default", "left-right", 0.0, exposure)
    flight.run(start - 0.1 / 30.0 * np.arange(FRAMES), world.geometry.row_height(1), np.zeros(FRAMES), 2, 1)
    assert flight.false == 0
    for score in flight.scores.values():
        score.check()


def places(count: int) -> np.ndarray:
    """Normalised places all over the picture, (n, 2)."""
    rng = np.random.default_rng(3)
    fx, fy, cx, cy = INTRINSICS
    pixels = rng.uniform((0.0, 0.0), (SHAPE[1] - 1.0, SHAPE[0] - 1.0), (count, 2))
    return (pixels - (cx, cy)) / (fx, fy)


def samples(light: np.ndarray, seed: int = 4) -> np.ndarray:
    """A white board in some light (n,) with noise, uint8 (n, 3)."""
    noise = np.random.default_rng(seed).normal(0.0, 2.0, (len(light), 3))
    return np.clip(np.rint(light[:, None] * WHITE + noise), 0, 255).astype(np.uint8)


def test_light_grows_from_the_middle_to_all_of_the_board() -> None:
    at = places(600)
    light = 0.75 * (1.0 + 0.35 * at[:, 0] / 0.51)
    found = fit_light(samples(light), at, 0.75 * WHITE, GATE, SHAPE, INTRINSICS)
    assert found is not None
    field, board = found
    assert np.abs(board / WHITE - 0.75).max() < 0.02
    assert np.abs(field.at(at) - np.log(light / 0.75)).max() < 0.06
    column, row = (at * 625.2 + (319.5, 239.5)).astype(int).T
    levels = field.levels[row >> CELL_BITS, column >> CELL_BITS]
    assert np.abs((levels.astype(float) + field.steps[0]) * LIGHT_STEP - np.log(light / 0.75)).max() < 0.06 + LIGHT_STEP


def test_even_light_is_none_whatever_is_printed() -> None:
    at = places(600)
    colors = samples(np.full(600, 0.8))
    assert fit_light(colors, at, 0.8 * WHITE, GATE, SHAPE, INTRINSICS) is None
    colors[at[:, 0] > 0.35] = (60, 60, 58)  # a grey print in one corner of the board is no shadow over it
    assert fit_light(colors, at, 0.8 * WHITE, GATE, SHAPE, INTRINSICS) is None


def test_a_step_to_another_material_is_no_light() -> None:
    """A grey board above a wall of a darker grey, at nearly its depth: a growing field would climb the step."""
    at, board = places(600), np.array([168.0, 170.0, 166.0])
    colors = np.where(at[:, 1:] > 0.0, 0.82 * board, board) + np.random.default_rng(3).normal(0.0, 12.0, (600, 3))
    for before in (None, LightField(np.array([0.0, 0.0, -0.1, 0.0, 0.0, 0.0]), (-0.2, 0.1), 0.51, SHAPE, INTRINSICS)):
        assert fit_light(colors, at, board, GATE, SHAPE, INTRINSICS, before) is None


def test_a_few_samples_of_a_wall_far_away_bend_no_field() -> None:
    """The board ends; a handful of the wall's samples have its depth and tint, and nothing lies between."""
    at, board = places(600), np.array([168.0, 170.0, 166.0])
    rng = np.random.default_rng(3)
    wall = at[:, 1] > 0.2
    kept = ~wall & (at[:, 1] < 0.05)
    kept |= wall & (np.cumsum(wall) <= 15)
    colors = np.where(wall[:, None], 0.76 * board, board) + rng.normal(0.0, 3.0, (600, 3))
    assert fit_light(colors[kept], at[kept], board, GATE, SHAPE, INTRINSICS) is None


@pytest.mark.parametrize("factor", [0.65, 0.75, 0.82, 1.12, 1.25, 1.4])
@pytest.mark.parametrize("turn", [0.0, 0.5, 1.1])
def test_no_step_is_light_whatever_its_size_and_angle(factor: float, turn: float) -> None:
    at, board, rng = places(600), np.array([168.0, 170.0, 166.0]), np.random.default_rng(5)
    beyond = at @ (np.sin(turn), np.cos(turn)) > 0.05
    colors = np.where(beyond[:, None], factor * board, board) + rng.normal(0.0, 8.0, (600, 3))
    assert fit_light(np.clip(colors, 0, 249), at, board, GATE, SHAPE, INTRINSICS) is None


@pytest.mark.parametrize("slope", [-0.4, -0.25, 0.25, 0.4])
@pytest.mark.parametrize("turn", [0.0, 0.5, 1.1])
def test_slopes_of_light_are_light_at_every_angle(slope: float, turn: float) -> None:
    """The same board in light instead of beside a wall, with the same noise."""
    at, board, rng = places(600), np.array([168.0, 170.0, 166.0]), np.random.default_rng(5)
    light = 1.0 + slope * (at @ (np.sin(turn), np.cos(turn))) / 0.51
    colors = light[:, None] * board + rng.normal(0.0, 8.0, (600, 3))
    found = fit_light(np.clip(colors, 0, 249), at, board, GATE, SHAPE, INTRINSICS)
    assert found is not None
    assert np.abs(found[0].at(at) - np.log(light)).max() < 0.12


def test_a_known_colour_of_the_board_stays_the_reference() -> None:
    at = places(600)
    light = 0.9 * (1.0 + 0.3 * at[:, 0] / 0.51)
    found = fit_light(samples(light), at, WHITE, GATE, SHAPE, INTRINSICS, anchored=True)
    assert found is not None
    assert np.abs(found[0].at(at) - np.log(light)).max() < 0.06


def test_few_samples_tell_nothing() -> None:
    at = places(30)
    assert fit_light(samples(np.linspace(0.5, 1.0, 30)), at, WHITE, GATE, SHAPE, INTRINSICS) is None


def test_a_field_is_not_continued_beyond_the_light_that_was_seen() -> None:
    field = LightField(np.array([0.0, 0.0, 0.0, 9.0, 0.0, 0.0]), (-0.1, 0.2), 0.51, SHAPE, INTRINSICS)
    assert np.abs(field.at(places(50))).max() <= 0.2
    assert products(np.array([0.5, -2.0])).tolist() == [1.0, 0.5, -2.0, 0.25, -1.0, 4.0]
