"""Places where the surface is looked for: beside the brush, and elsewhere where nothing beside it is in view."""

from __future__ import annotations

import numpy as np

from ibvs_qp.config import VehicleParams
from ibvs_qp.vision.picture.grid import CoarseGrid
from ibvs_qp.vision.surface.seeds import seed_cells

SHAPE, INTRINSICS, BRUSH_M = (480, 640), (625.2, 625.2, 319.5, 239.5), 0.08


def test_seeds_lie_beside_the_brush() -> None:
    grid = CoarseGrid(SHAPE, INTRINSICS, np.zeros(SHAPE, np.uint8), 80)
    cells = seed_cells(grid, VehicleParams(), BRUSH_M)
    rows = [row for row, _ in cells]
    assert len(cells) == 8 and max(rows) == grid.cell_at(320, 140)[0]


def test_with_everything_beside_the_brush_hidden_the_surface_is_looked_for_below() -> None:
    mask = np.zeros(SHAPE, np.uint8)
    mask[:250] = 255  # propellers and a brush at the upper border
    grid = CoarseGrid(SHAPE, INTRINSICS, mask, 80)
    cells = seed_cells(grid, VehicleParams(), BRUSH_M)
    assert cells and all(grid.free[cell] for cell in cells)
