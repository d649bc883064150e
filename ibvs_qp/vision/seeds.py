"""Where the working surface surely is: beside the brush, at the height of the tip."""

from __future__ import annotations

import numpy as np

from ibvs_qp.frames import to_camera
from ibvs_qp.vehicle import VehicleParams
from ibvs_qp.vision.grid import CoarseGrid

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
