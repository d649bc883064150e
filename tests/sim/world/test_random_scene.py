"""Random scenes: valid, flyable on paper, within their ranges, repeatable, and in families without a common scene."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from ibvs_qp.config.errors import ConfigError
from ibvs_qp.config.settings import from_dict, to_dict
from sim.sweep.setup import Setup, unit_of, value_at
from sim.world.board import BoardGeometry
from sim.world.errors import WorldErrors
from sim.world.random_scene import CONTRAST, EVALUATION, FAMILIES, MASS, RANGES, SPARE, TUNING, random_scene
from sim.world.scene import Scene

COUNT = 200
SCENES = {family: [random_scene(seed, family) for seed in range(COUNT)] for family in FAMILIES}
EVERY = [scene for scenes in SCENES.values() for scene in scenes]


def test_every_scene_is_valid_and_has_no_errors_of_its_own():
    for scene in EVERY:
        assert from_dict(Scene, to_dict(scene)) == scene
        assert scene.errors == WorldErrors()


def test_both_rows_fit_on_every_board():
    for scene in EVERY:
        board, paint, geometry = scene.board, scene.paint, BoardGeometry(scene)
        half = 0.5 * paint.brush_width_m
        assert geometry.row_ends[0] >= half and geometry.row_ends[1] + half <= board.width_m
        assert geometry.row_height(1) >= half and geometry.row_height(paint.rows) + half <= board.height_m
        assert paint.stroke_m <= board.width_m - 2.0 * paint.edge_margin_m


def test_every_start_is_before_the_board_and_above_the_ground():
    for scene in EVERY:
        x, _, down = BoardGeometry(scene).start_tip
        assert x <= -RANGES["start.distance_m"].low and down <= -0.7


@pytest.mark.slow
@pytest.mark.parametrize("path", RANGES)
def test_numbers_fill_their_range_with_the_unit_of_the_setting(path):
    span = RANGES[path]
    values = np.array([value_at(Setup(scene=scene), f"scene.{path}") for scene in EVERY])
    assert span.unit == unit_of(f"scene.{path}") and span.reason
    assert span.low <= values.min() <= span.at(0.05) and span.at(0.95) <= values.max() <= span.high
    assert np.median(values) == pytest.approx(span.at(0.5), abs=0.2 * (span.high - span.low))


def test_mass_and_length_of_rows_keep_their_range():
    for scene in EVERY:
        assert scene.plant.mass_kg is not None and MASS.low <= scene.plant.mass_kg / 6.0 <= MASS.high
        spare = scene.board.width_m - 2.0 * scene.paint.edge_margin_m - scene.paint.stroke_m
        assert SPARE.low - 1e-9 <= spare <= SPARE.high + 1e-9


def test_colours_differ():
    for scene in EVERY:
        colors = scene.board.color, scene.wall.color, scene.paint.color
        assert all(math.dist(a, b) >= CONTRAST for a, b in itertools.combinations(colors, 2))


def test_a_number_repeats_its_scene_and_the_families_share_nothing():
    for family, scenes in SCENES.items():
        assert random_scene(7, family) == scenes[7]
    seeds = {family: {scene.board.texture_seed for scene in scenes} for family, scenes in SCENES.items()}
    assert all(seed % 2 == 0 for seed in seeds[TUNING]) and all(seed % 2 == 1 for seed in seeds[EVALUATION])
    numbers = {family: {scene.wall.stiffness_n_m for scene in scenes} for family, scenes in SCENES.items()}
    assert len(numbers[TUNING] | numbers[EVALUATION]) == 2 * COUNT


def test_an_unknown_family_is_refused():
    with pytest.raises(ConfigError, match="tuning, evaluation"):
        random_scene(0, "test")
