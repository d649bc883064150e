"""The surface around a seed: its plane, the samples on it by depth, and its colour."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ibvs_qp.measurement import RgbdFrame
from ibvs_qp.vision.appearance.colors import BOARD, OTHER, SurfaceColors
from ibvs_qp.vision.config import PlaneConfig
from ibvs_qp.vision.picture.grid import CoarseGrid
from ibvs_qp.vision.surface.evenly_lit import evenly_lit
from ibvs_qp.vision.surface.ground import connected, ground_color
from ibvs_qp.vision.surface.grow import grown_plane
from ibvs_qp.vision.surface.plane import PlaneEstimate, PlaneFitter
from ibvs_qp.vision.surface.region import SurfaceRegion, alike_colors, filled, middle_cell, samples_on

#: Where more than this share of all readings lies on one plane, a wall may be part of it.
_FLUSH_SHARE = 0.40


class _SeedLabels:
    """Colour labels for every seed, made when they are read: mostly only the first seed's are."""

    def __init__(self, make: Callable[[int], np.ndarray]) -> None:
        self._make, self._made = make, dict[int, np.ndarray]()

    def __getitem__(self, index: int, /) -> np.ndarray:
        if index not in self._made:
            self._made[index] = self._make(index)
        return self._made[index]


def find_surface(
    frame: RgbdFrame,
    grid: CoarseGrid,
    fitter: PlaneFitter,
    config: PlaneConfig,
    seeds: list[tuple[int, int]],
    colors: SurfaceColors,
    down: np.ndarray | None,
    bare: bool,
) -> SurfaceRegion | str:
    """Fit the surface through one of the seeds, or say why there is none.

    Args:
        frame: Colour and depth.
        grid: Coarse grid of the picture.
        fitter: Plane fit.
        config: Its settings.
        seeds: Cells on which the surface may lie.
        colors: What is known of the colours of board and paint.
        down: Gravity's direction in C, unit, (3,), or None if unknown.
        bare: Whether the seeds lie where nothing is printed or painted.
    """
    coarse = grid.sample(frame.rgb)
    inverse = grid.inverse_depth(frame.depth, config.distance_min_m, config.distance_max_m)
    if colors.board is None:
        seeds = colors.bare(grid, coarse, seeds, config.seed_radius)
    labels = _SeedLabels(lambda index: _labels(grid, coarse, seeds[index], colors, config.seed_radius, bare))
    plane = fitter.search(grid, inverse, seeds, down, labels)
    if isinstance(plane, str):
        return (depth_problem(frame.depth, grid, seeds[0], config) if seeds else None) or plane
    index = next((index for index, seed in enumerate(seeds) if plane.component[seed]), 0)
    if not bare:
        return _around_seed(frame, grid, fitter, config, seeds[index], colors, down, plane, labels[index])
    color = colors.board
    if color is None:
        color = np.median(coarse[(labels[index] == BOARD) & plane.component].astype(float), axis=0)
    cells = samples_on(grid, inverse, plane, seeds[index])
    return _region(grid, coarse, plane, cells, color, colors, colors.like(coarse, color), inverse, False)


def _around_seed(
    frame: RgbdFrame,
    grid: CoarseGrid,
    fitter: PlaneFitter,
    config: PlaneConfig,
    seed: tuple[int, int],
    colors: SurfaceColors,
    down: np.ndarray | None,
    plane: PlaneEstimate,
    prefer: np.ndarray,
) -> SurfaceRegion:
    """The surface around a seed that may lie on something printed, with a plane through it to start from.

    A plane may tilt through the surface and a wall close behind it. So it grows outwards from the seed, and is fitted
    once more to the samples of the surface's own colour.
    """
    coarse = grid.sample(frame.rgb)
    inverse = grid.inverse_depth(frame.depth, config.distance_min_m, config.distance_max_m)
    own = np.where(prefer == BOARD, inverse, 0.0)
    start = own if int(np.count_nonzero(own)) >= config.min_samples else inverse
    start = grown_plane(grid, start, seed, plane.inverse_depth, config)
    grown = fitter.track(grid, inverse, start, down, prefer, seed)
    plane = grown if isinstance(grown, PlaneEstimate) else plane
    cells = samples_on(grid, inverse, plane, seed)
    color = ground_color(frame.rgb, grid, coarse, cells, seed) if colors.board is None else colors.board
    alike = alike_colors(coarse, color)
    # where depth does not tell the surface from a wall close behind it, its light has to
    even = evenly_lit(frame.rgb, grid, cells & alike, seed) if _flush(cells, inverse) else None
    # in some light a wall may have the surface's colour: the plane is that of the colour itself
    prefer = colors.like(coarse, color) if even is None else np.where(even, np.uint8(BOARD), np.uint8(OTHER))
    own = cells & (prefer == BOARD)
    if int(own.sum()) >= config.min_samples:
        again = fitter.track(grid, inverse, plane.inverse_depth, down, prefer, middle_cell(own))
        if isinstance(again, PlaneEstimate):
            plane = again
            cells = samples_on(grid, inverse, plane, middle_cell(own))
    flush = even is not None or _flush(cells, inverse)
    if even is None and flush:  # noise may hide the wall until the plane is exact
        even = evenly_lit(frame.rgb, grid, cells & alike, seed)
    if even is not None:  # what else has its depth is the wall
        cells, alike = cells & even, alike | even
    elif flush:
        alike = prefer == BOARD
        cells = _without_wall(cells, alike, grid)
    return SurfaceRegion(grid=grid, plane=plane, cells=cells, colored=cells & alike, color=color, by_color=flush)


def followed_region(
    frame: RgbdFrame,
    grid: CoarseGrid,
    config: PlaneConfig,
    plane: PlaneEstimate,
    colors: SurfaceColors,
    before: SurfaceRegion,
) -> SurfaceRegion:
    """The samples of a surface whose plane, on this grid, is known; ``before`` is the region so far."""
    coarse = grid.sample(frame.rgb)
    inverse = grid.inverse_depth(frame.depth, config.distance_min_m, config.distance_max_m)
    cells = samples_on(grid, inverse, plane, middle_cell(plane.component))
    if colors.board is None:
        color, labels = before.color, colors.like(coarse, before.color)
    else:
        color, labels = colors.board, colors.label(coarse, colors.levels_at(*grid.pixels))
    return _region(grid, coarse, plane, cells, color, colors, labels, inverse, before.by_color)


def _region(
    grid: CoarseGrid,
    coarse: np.ndarray,
    plane: PlaneEstimate,
    cells: np.ndarray,
    color: np.ndarray,
    colors: SurfaceColors,
    labels: np.ndarray,
    inverse: np.ndarray,
    by_color: bool,
) -> SurfaceRegion:
    """The samples on a plane; where a wall may be among them, those that the colours of board and paint enclose.

    A wall may have the board's colour in another light than its own: then only its very colour counts. Without the
    paint's colour nothing is left out, for what is painted may part the board; unless colour told it before.
    """
    flush = _flush(cells, inverse)
    alike = labels == BOARD if flush or colors.light is not None else alike_colors(coarse, color)
    enclosed = flush and (by_color or colors.paint is not None)
    if enclosed:
        cells = _without_wall(cells, labels != OTHER, grid)
    return SurfaceRegion(grid=grid, plane=plane, cells=cells, colored=cells & alike, color=color, by_color=enclosed)


def _labels(
    grid: CoarseGrid, coarse: np.ndarray, seed: tuple[int, int], colors: SurfaceColors, radius: int, bare: bool
) -> np.ndarray:
    """Labels of the samples, uint8 (rows, columns): by the board's colour, before it is known by that of the seed.

    A seed may lie on something printed: then what is apart from it is something else.
    """
    if colors.board is not None:
        return colors.label(coarse, colors.levels_at(*grid.pixels))
    labels = colors.like_around(grid, coarse, seed, radius)
    if bare:
        return labels
    board = labels == BOARD
    return np.where(board & ~connected(board, grid, seed), np.uint8(OTHER), labels)


def _without_wall(cells: np.ndarray, alike: np.ndarray, grid: CoarseGrid) -> np.ndarray:
    """Samples that depth cannot tell from a wall, without what the surface's colour does not enclose."""
    own = cells & alike
    return cells & (filled(connected(own, grid, middle_cell(own))) > 0) if own.any() else cells


def _flush(cells: np.ndarray, inverse: np.ndarray) -> bool:
    """Whether so much lies on the surface's plane that a wall may be part of it."""
    return int(cells.sum()) > _FLUSH_SHARE * int(np.count_nonzero(inverse))


def depth_problem(depth: np.ndarray, grid: CoarseGrid, seed: tuple[int, int], config: PlaneConfig) -> str | None:
    """Why depth cannot give a surface at a seed: absent, or in wrong units; None if it is neither."""
    samples = grid.sample(depth)
    valid = samples[np.isfinite(samples) & (samples > 0.0)]
    if len(valid) == 0:
        return "the depth picture holds no valid reading"
    low, high = config.distance_min_m, config.distance_max_m
    typical = float(np.median(valid))
    if not low <= typical <= high and float(((valid > low) & (valid < high)).mean()) < 0.1:
        return (
            f"depth of {typical:.3g} m in the middle is out of the camera's range ({low:g} to {high:g} m): "
            "are the depth units per metre right?"
        )
    rows, columns = grid.window(seed, config.seed_radius)
    around = samples[rows, columns]
    around = around[np.isfinite(around) & (around > 0.0)]
    if len(around) == 0:
        return "no valid depth around the seed"
    near = float(np.median(around))
    if not low <= near <= high:
        return f"depth of {near:.3g} m at the seed is out of range ({low:g} to {high:g} m)"
    return None
