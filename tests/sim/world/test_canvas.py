"""Board picture: what a stroke leaves behind, to a tenth of a pixel, and what the seeds decide."""

from __future__ import annotations

import dataclasses
import itertools
from pathlib import Path

import numpy as np
import pytest

import sim.scenes
from sim.world.canvas import Canvas
from sim.world.scene import BoardScene, PaintScene, Scene, load_scene

SCENE = Scene()
SCENES = Path(sim.scenes.__file__).parent
PX = 1000.0  # px/m
BRUSH = SCENE.paint.brush_width_m


@pytest.fixture(scope="module")
def blank() -> Canvas:
    return Canvas(SCENE, 0)


@pytest.fixture
def canvas() -> Canvas:
    return Canvas(Scene(board=BoardScene(width_m=0.6, height_m=0.3, clutter=0)), 0)


@pytest.mark.parametrize("up", [0.0500, 0.0513, 0.1206, 0.1537])
def test_stroke_width_and_edges_to_a_tenth_of_a_pixel(canvas: Canvas, up: float) -> None:
    along = np.linspace(0.1, 0.5, 1001)  # 0.4 mm a step: 0.1 m/s at 250 Hz
    canvas.stroke(None, (along[0], up))
    for start, stop in itertools.pairwise(along):
        canvas.stroke((start, up), (stop, up))
    middle = canvas.coverage[:, 200:400]  # clear of both caps
    width = middle.sum(axis=0)  # summed coverage is the width in pixels
    assert np.abs(width - BRUSH * PX).max() < 0.1
    rows = 300.0 - up * PX - np.array([0.5, -0.5]) * BRUSH * PX  # upper and lower edge from the top [px]
    split = round(300 - up * PX)
    above = split - middle[:split].sum(axis=0)
    below = split + middle[split:].sum(axis=0)
    assert np.abs(above - rows[0]).max() < 0.1
    assert np.abs(below - rows[1]).max() < 0.1
    assert width.std() < 0.01, "a straight stroke has a straight edge, no saw teeth"


def test_slanted_stroke_keeps_its_width(canvas: Canvas) -> None:
    start, stop = np.array([0.1, 0.08]), np.array([0.5, 0.20])
    canvas.stroke(start, stop)
    slant = float(np.hypot(*(stop - start)) / (stop - start)[0])
    width = canvas.coverage[:, 250:350].sum(axis=0) / slant
    assert np.abs(width - BRUSH * PX).max() < 0.1


def test_caps_are_round_and_antialiased(canvas: Canvas) -> None:
    canvas.stroke(None, (0.3003, 0.1498))
    coverage = canvas.coverage
    radius = 0.5 * BRUSH * PX
    assert coverage.sum() == pytest.approx(np.pi * radius**2, rel=1e-3)
    rows, columns = np.mgrid[: coverage.shape[0], : coverage.shape[1]]
    distance = np.hypot(columns + 0.5 - 300.3, rows + 0.5 - (300.0 - 149.8))
    assert coverage[distance < radius - 1.0].min() == 1.0
    assert coverage[distance > radius + 1.0].max() == 0.0
    rim = coverage[np.abs(distance - radius) < 0.5]
    assert np.unique(np.rint(rim * 16)).size > 10, "the rim takes every grey value"
    assert np.abs(rim - (radius + 0.5 - distance[np.abs(distance - radius) < 0.5])).max() < 0.1


def test_rows_and_columns_are_board_coordinates(canvas: Canvas) -> None:
    canvas.stroke(None, (0.1, 0.25))  # left and high: small column, small row
    rows, columns = np.nonzero(canvas.coverage > 0.5)
    assert np.mean(columns) + 0.5 == pytest.approx(100.0, abs=0.1)
    assert np.mean(rows) + 0.5 == pytest.approx(50.0, abs=0.1)


def test_paint_shows_its_colour_and_only_where_it_covers(canvas: Canvas) -> None:
    before = canvas.rgb
    canvas.stroke((0.2, 0.15), (0.4, 0.15))
    after, coverage = canvas.rgb, canvas.coverage
    assert np.array_equal(before[coverage == 0.0], after[coverage == 0.0])
    painted = after[coverage == 1.0].astype(float)
    assert np.abs(painted.mean(axis=0) - SCENE.paint.color).max() < 3.0
    half = np.abs(coverage - 0.5) < 0.1
    expected = 0.5 * (np.array(SCENE.board.color) + SCENE.paint.color)
    assert np.abs(after[half].astype(float).mean(axis=0) - expected).max() < 6.0


def test_painting_twice_changes_nothing(canvas: Canvas) -> None:
    canvas.stroke((0.2, 0.15), (0.4, 0.15))
    once = canvas.coverage
    canvas.stroke((0.2, 0.15), (0.4, 0.15))
    assert np.array_equal(once, canvas.coverage)


def test_strokes_over_the_outline_are_cut_there(canvas: Canvas) -> None:
    canvas.stroke((-0.1, 0.0), (0.7, 0.0))
    assert canvas.coverage[-39:, 10:-10].min() == 1.0
    assert canvas.coverage.shape == (300, 600)


def test_one_seed_one_picture() -> None:
    small = Scene(board=BoardScene(width_m=0.5, height_m=0.3))
    first, again, other = Canvas(small, 3), Canvas(small, 3), Canvas(small, 4)
    assert np.array_equal(first.rgb, again.rgb) and np.array_equal(first.wall, again.wall)
    assert not np.array_equal(first.rgb, other.rgb) and not np.array_equal(first.wall, other.wall)
    turned = dataclasses.replace(small, board=dataclasses.replace(small.board, texture_seed=9))
    assert not np.array_equal(first.rgb, Canvas(turned, 3).rgb)


def test_board_grain_is_faint_and_rim_darker() -> None:
    plain = Canvas(Scene(board=BoardScene(clutter=0)), 0).rgb.astype(float).mean(axis=2)
    face = plain[50:-50, 50:-50]
    assert 1.0 < face.std() < 6.0
    assert 3.0 < face.mean() - plain[-4:].mean() < 12.0


def test_wall_reaches_far_beyond_the_board(blank: Canvas) -> None:
    height, width = np.array(blank.wall.shape[:2]) / blank.wall_pixels_per_m
    assert width >= SCENE.board.width_m + 2.4 and height >= SCENE.board.height_m + 2.4
    assert blank.wall[..., :3].astype(float).std() > 8.0, "the wall has visible texture"


@pytest.mark.parametrize("seed", range(5))
def test_clutter_leaves_the_outline_of_the_board_alone(seed: int) -> None:
    crowded = Canvas(Scene(board=BoardScene(clutter=40)), seed).rgb.astype(int)
    strip = np.concatenate([crowded[-17:].reshape(-1, 3), crowded[:, :17].reshape(-1, 3)])
    assert np.abs(strip - np.array(SCENE.board.color)).max() < 35
    inside = np.abs(crowded[20:-20, 20:-20] - np.array(SCENE.board.color)).max(axis=2) > 40
    assert inside.mean() > 0.005, "there is clutter"


def test_large_boards_do_not_fill_the_memory() -> None:
    scene = Scene(board=BoardScene(width_m=12.0, height_m=6.0, clutter=2), paint=PaintScene(stroke_m=5.0))
    canvas = Canvas(scene, 0)
    assert canvas.pixels_per_m < 1000.0 and canvas.rgb.size < 4e7
    canvas.stroke((2.0, 3.0), (4.0, 3.0))
    width = canvas.coverage[:, round(3.0 * canvas.pixels_per_m)].sum() / canvas.pixels_per_m
    assert width == pytest.approx(BRUSH, abs=0.0003)


@pytest.mark.parametrize("name", sorted(file.stem for file in SCENES.glob("*.toml")))
def test_shipped_scenes_fit_their_rows(name: str) -> None:
    scene = load_scene(SCENES / f"{name}.toml")
    board, paint = scene.board, scene.paint
    assert board.width_m >= paint.stroke_m + 2.0 * paint.edge_margin_m - 1e-9
    top = paint.edge_margin_m + (paint.rows - 1) * paint.pitch_m + 0.5 * paint.brush_width_m
    assert board.height_m >= top + paint.edge_margin_m
    contrast = np.linalg.norm(np.subtract(board.color, paint.color))
    assert contrast > 60.0


def test_default_scene_file_states_the_defaults() -> None:
    assert load_scene(SCENES / "default.toml") == Scene()
