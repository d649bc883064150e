"""Cells of the picture that show the working surface, beside the place where the tip will meet it; their depth.

The tip meets a surface straight ahead of it. In the picture that place moves with the distance: at the depth Z of the
surface it lies at (x, y) / Z, where (x, y) is the tip from the camera.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.frames import to_camera
from ibvs_qp.vision.config import PlaneConfig
from ibvs_qp.vision.picture.grid import CoarseGrid

#: Distances of the seeds from the tip's image, in brush radii: just outside the brush, then farther.
_STEPS = (1.7, 2.6)
#: Farther ones where all of those are hidden or outside the picture; on the other side of the tip, too.
_FAR_STEPS = (4.0, 6.0, 9.0)
#: Where the surface lies from the tip at the beginning of a job, (right, down), unless it is stated.
UP_LEFT = (-1, -1)
#: Depths for which seeds are laid, as multiples of the one before, the nearest and the farthest one [m].
_RATIO, _NEAREST_M, _FARTHEST_M = 1.15, 0.05, 2.6


@dataclass(frozen=True, slots=True)
class Seeds:
    """Cells beside the place where the tip meets a surface, which lies at one depth [m]."""

    depth: float
    cells: list[tuple[int, int]]


def seeds_ahead(
    grid: CoarseGrid, vehicle: VehicleParams, brush_width_m: float, inwards: tuple[int, int] = UP_LEFT
) -> list[Seeds]:
    """Seeds for a surface in contact, then for farther ones; the vehicle hides none of them.

    Args:
        grid: Where samples lie.
        vehicle: Tip and camera.
        brush_width_m: Diameter of the brush, the distance of seeds [m].
        inwards: Where the surface lies from the tip at the beginning of a job, (right, down): +1 or -1 each.
    """
    x, y, z = to_camera(np.asarray(vehicle.tip_position_m, float), np.asarray(vehicle.camera_position_m, float))
    nearest = max(z, _NEAREST_M)
    count = 1 + max(math.ceil(math.log(_FARTHEST_M / nearest, _RATIO)), 0)
    rungs = [nearest * _RATIO**k for k in range(count)]
    radius = 0.5 * brush_width_m
    return [Seeds(z, _beside(grid, (x / z, y / z), radius / z, inwards)) for z in rungs]


def _beside(
    grid: CoarseGrid, center: tuple[float, float], radius: float, inwards: tuple[int, int]
) -> list[tuple[int, int]]:
    """Cells beside a place and inwards of it, else anywhere near; those nearest to the tip first."""
    right, down = inwards
    aside = ((right, 0), (-right, 0), (right, down), (-right, down))
    around = (*aside, (right, -down), (-right, -down), (0, -down), (0, down))
    near = _free_cells(grid, center, radius, _STEPS, aside)
    return near or _free_cells(grid, center, radius, (*_STEPS, *_FAR_STEPS), around)


def _free_cells(
    grid: CoarseGrid,
    center: tuple[float, float],
    radius: float,
    steps: tuple[float, ...],
    directions: tuple[tuple[int, int], ...],
) -> list[tuple[int, int]]:
    """Cells at steps of a radius from a normalised place that nothing hides, those of the first step first."""
    fx, fy, cx, cy = grid.intrinsics
    x, y = (c + np.multiply.outer(steps, way) * radius for c, way in zip(center, np.transpose(directions), strict=True))
    rows, columns, inside = grid.cells_at(fx * x + cx, fy * y + cy)
    free = inside & grid.free[rows, columns]
    return list(zip(rows[free].tolist(), columns[free].tolist(), strict=True))


def facing(grid: CoarseGrid, depth: np.ndarray, ladder: list[Seeds], config: PlaneConfig) -> list[tuple[int, int]]:
    """The seeds at which a picture has the depth for which they were laid; without any, those of a contact."""
    if not ladder:
        return []
    cells, gate = [(cell, seeds.depth) for seeds in ladder for cell in seeds.cells], math.sqrt(_RATIO)
    values = seed_values(grid, grid.inverse_depth(depth, config), [cell for cell, _ in cells], config.seed_radius)
    fitting = [cell for (cell, z), value in zip(cells, values, strict=True) if 1.0 / gate < value * z < gate]
    return list(dict.fromkeys(fitting)) or ladder[0].cells  # no cell twice, in order


def seed_values(grid: CoarseGrid, inverse: np.ndarray, seeds: list[tuple[int, int]], radius: int) -> list[float]:
    """Upper median 1/Z around every seed [1/m], within a radius [cells]; 0 where too few samples have one."""
    if not seeds:
        return []
    windows, least = grid.windows(seeds, radius), 2 * radius + 1
    known = inverse.reshape(-1).take(windows)
    known[~grid.free.reshape(-1).take(windows) | ~(known > 0.0)] = np.inf
    known.sort(axis=1)
    counts = np.count_nonzero(known < np.inf, axis=1).tolist()
    return [float(row[count // 2]) if count >= least else 0.0 for row, count in zip(known, counts, strict=True)]
