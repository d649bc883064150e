"""Places where the surface is looked for: beside where the tip will meet it, and elsewhere where that is hidden."""

from __future__ import annotations

import numpy as np
import pytest

from ibvs_qp.config import VehicleParams
from ibvs_qp.vision.config import PlaneConfig
from ibvs_qp.vision.picture.layout import CoarseGrid, seeds_ahead
from ibvs_qp.vision.surface.search import facing

SHAPE, INTRINSICS, BRUSH_M = (480, 640), (625.2, 625.2, 319.5, 239.5), 0.08


def grid_of(mask: np.ndarray | None = None) -> CoarseGrid:
    return CoarseGrid(INTRINSICS, np.zeros(SHAPE, np.uint8) if mask is None else mask, PlaneConfig())


def test_seeds_of_a_contact_lie_beside_the_brush() -> None:
    grid = grid_of()
    cells = seeds_ahead(grid, VehicleParams(), BRUSH_M)[0].cells
    rows = [row for row, _ in cells]
    assert len(cells) == 8 and max(rows) == grid.cells_at(320, 140)[0]


def test_with_everything_beside_the_brush_hidden_the_surface_is_looked_for_below() -> None:
    mask = np.zeros(SHAPE, np.uint8)
    mask[:250] = 255  # propellers and a brush at the upper border
    grid = grid_of(mask)
    cells = seeds_ahead(grid, VehicleParams(), BRUSH_M)[0].cells
    assert cells and all(grid.free[cell] for cell in cells)


@pytest.mark.parametrize("depth", [0.5, 0.8, 1.0, 1.5])
def test_seeds_follow_the_place_where_the_tip_will_meet_the_surface(depth: float) -> None:
    grid = grid_of()
    ladder = seeds_ahead(grid, VehicleParams(), BRUSH_M)
    cells = facing(grid, grid.inverse_depth(np.full(SHAPE, depth, np.float32)), ladder, PlaneConfig().seed_radius)
    x, y = -1.7 * 0.5 * BRUSH_M / depth, -0.08 / depth  # the tip is 0.08 m above the camera
    row, column, _ = grid.cells_at(INTRINSICS[0] * x + INTRINSICS[2], INTRINSICS[1] * y + INTRINSICS[3])
    assert cells and abs(cells[0][0] - row) <= 1 and abs(cells[0][1] - column) <= 1


def test_the_first_seed_lies_inwards_of_the_corner_at_which_the_job_begins() -> None:
    grid, tip = grid_of(), round(INTRINSICS[2])
    for right in (-1, 1):
        column = seeds_ahead(grid, VehicleParams(), BRUSH_M, (right, 1))[0].cells[0][1]
        assert (column - grid.cells_at(tip, 0)[1]) * right > 0


def test_without_depth_at_any_distance_those_of_a_contact_remain() -> None:
    grid = grid_of()
    ladder = seeds_ahead(grid, VehicleParams(), BRUSH_M)
    assert facing(grid, np.zeros(grid.shape), ladder, PlaneConfig().seed_radius) == ladder[0].cells
