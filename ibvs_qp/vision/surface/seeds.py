"""Where the working surface surely is: beside the brush, at the height of the tip; and how far it is there."""

from __future__ import annotations

import numpy as np

from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.frames import to_camera
from ibvs_qp.vision.picture.grid import CoarseGrid

#: Distances of the seeds from the tip's image, in brush radii: just outside the brush, then farther.
_STEPS = (1.7, 2.6)


def seed_cells(grid: CoarseGrid, vehicle: VehicleParams, brush_width_m: float) -> list[tuple[int, int]]:
    """Cells around the brush's image that the vehicle does not hide: left, right and above."""
    x, y, z = to_camera(np.asarray(vehicle.tip_position_m, float), np.asarray(vehicle.camera_position_m, float))
    radius = 0.5 * brush_width_m / z
    rows, columns = grid.shape
    found = []
    for step in _STEPS:
        for across, down in ((-step, 0.0), (step, 0.0), (-step, -step), (step, -step)):
            cell = grid.cell(x / z + across * radius, y / z + down * radius)
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
