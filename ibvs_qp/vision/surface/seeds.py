"""Where the working surface surely is: beside the brush, at the height of the tip; and how far it is there."""

from __future__ import annotations

import numpy as np

from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.frames import to_camera
from ibvs_qp.vision.picture.grid import CoarseGrid

#: Distances of the seeds from the tip's image, in brush radii: just outside the brush, then farther.
_STEPS = (1.7, 2.6)
#: Farther ones where all of those are hidden or outside the picture; below the brush, too.
_FAR_STEPS = (4.0, 6.0, 9.0)
_ASIDE = ((-1.0, 0.0), (1.0, 0.0), (-1.0, -1.0), (1.0, -1.0))
_AROUND = (*_ASIDE, (-1.0, 1.0), (1.0, 1.0), (0.0, 1.0), (0.0, -1.0))


def seed_cells(grid: CoarseGrid, vehicle: VehicleParams, brush_width_m: float) -> list[tuple[int, int]]:
    """Cells around the brush's image that the vehicle does not hide: left, right and above, else anywhere near."""
    x, y, z = to_camera(np.asarray(vehicle.tip_position_m, float), np.asarray(vehicle.camera_position_m, float))
    center, radius = (x / z, y / z), 0.5 * brush_width_m / z
    near = _free_cells(grid, center, radius, _STEPS, _ASIDE)
    return near or _free_cells(grid, center, radius, (*_STEPS, *_FAR_STEPS), _AROUND)


def _free_cells(
    grid: CoarseGrid,
    center: tuple[float, float],
    radius: float,
    steps: tuple[float, ...],
    directions: tuple[tuple[float, float], ...],
) -> list[tuple[int, int]]:
    rows, columns = grid.shape
    found = []
    for step in steps:
        for across, down in directions:
            cell = grid.cell(center[0] + step * across * radius, center[1] + step * down * radius)
            if 0 <= cell[0] < rows and 0 <= cell[1] < columns and grid.free[cell]:
                found.append(cell)
    return found


def seed_values(grid: CoarseGrid, inverse: np.ndarray, seeds: list[tuple[int, int]], radius: int) -> list[float]:
    """Upper median 1/Z around every seed [1/m], 0 where too few samples have one.

    Args:
        grid: Where the samples lie.
        inverse: 1/Z of the samples [1/m], 0 where absent, (rows, columns).
        seeds: Cells.
        radius: Half width of the window around a seed [cells].
    """
    if not seeds:
        return []
    windows, least = grid.windows(seeds, radius), 2 * radius + 1
    known = inverse.reshape(-1).take(windows)
    known[~grid.free.reshape(-1).take(windows) | ~(known > 0.0)] = np.inf
    known.sort(axis=1)
    counts = np.count_nonzero(known < np.inf, axis=1).tolist()
    return [float(row[count // 2]) if count >= least else 0.0 for row, count in zip(known, counts, strict=True)]
