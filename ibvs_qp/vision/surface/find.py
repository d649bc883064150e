"""The surface around a seed: its plane, the samples on it by depth, and its colour."""

from __future__ import annotations

import functools

import numpy as np

from ibvs_qp.measurement import RgbdFrame
from ibvs_qp.vision.appearance.colors import BOARD, OTHER, SurfaceColors
from ibvs_qp.vision.appearance.labels import alike_colors
from ibvs_qp.vision.config import PlaneConfig
from ibvs_qp.vision.picture.grid import CoarseGrid, Samples
from ibvs_qp.vision.surface.ground import evenly_lit, ground_color
from ibvs_qp.vision.surface.plane import PlaneEstimate, refit_plane
from ibvs_qp.vision.surface.region import SurfaceRegion, connected, filled, middle_cell, samples_on
from ibvs_qp.vision.surface.search import PlaneSearch, grown_plane

#: Where more than this fraction of all readings lies on one plane, a wall may be part of it.
_FLUSH_SHARE = 0.40


class SurfaceFinder:
    """Finds the surface with its colour, and the region of one whose plane is known.

    Args:
        config: Settings of the plane.
        colors: Colours of board and paint, as far as they are known.
    """

    def __init__(self, config: PlaneConfig, colors: SurfaceColors) -> None:
        self._config, self._colors, self._search = config, colors, PlaneSearch(config)

    def reset(self) -> None:
        """Start the random search again as new."""
        self._search.reset()

    def find(
        self, frame: RgbdFrame, grid: CoarseGrid, seeds: list[tuple[int, int]], down: np.ndarray | None, bare: bool
    ) -> SurfaceRegion | str:
        """Fit the surface through one of the seeds, or return why it is missing.

        Args:
            frame: Colour and depth.
            grid: Coarse grid of the picture.
            seeds: Cells on which the surface may lie.
            down: Gravity's direction in C, unit, (3,), or None if unknown.
            bare: Whether the seeds lie where nothing is printed or painted.
        """
        config, colors, samples = self._config, self._colors, grid.read(frame, self._config)
        if colors.board is None:
            seeds = colors.bare(grid, samples.colors, seeds, config.seed_radius)
        labels = functools.cache(lambda index: self._labels(samples, seeds[index], bare))  # mostly of the first alone
        plane = self._search.search(grid, samples.inverse, seeds, down, labels)
        if isinstance(plane, str):
            return (depth_problem(frame.depth, grid, seeds[0], config) if seeds else None) or plane
        index = next((index for index, seed in enumerate(seeds) if plane.component[seed]), 0)
        if not bare:
            return self._around_seed(samples, seeds[index], down, plane, labels(index))
        color = colors.board
        if color is None:
            color = np.median(samples.colors[(labels(index) == BOARD) & plane.component].astype(float), axis=0)
        cells = samples_on(samples, plane, seeds[index])
        return self._region(samples, plane, cells, color, colors.like(samples.colors, color), by_color=False)

    def follow(self, samples: Samples, plane: PlaneEstimate, before: SurfaceRegion) -> SurfaceRegion:
        """The samples of a surface whose plane, on this grid, is known; `before` is the region so far."""
        colors, cells = self._colors, samples_on(samples, plane, middle_cell(plane.component))
        color, labels = before.color, self.labels(samples)
        if labels is None:
            labels = colors.like(samples.colors, color)
        elif colors.board is not None:
            color = colors.board
        return self._region(samples, plane, cells, color, labels, before.by_color)

    def labels(self, samples: Samples) -> np.ndarray | None:
        """Labels of the samples in their light, uint8 (rows, columns); None for an unknown board."""
        if self._colors.board is None:
            return None
        return self._colors.label(samples.colors, *samples.grid.pixels)

    def _labels(self, samples: Samples, seed: tuple[int, int], bare: bool) -> np.ndarray:
        """Labels of the samples: by the board's colour, before it is known by that of the seed.

        A seed may lie on something printed: then parts apart from it are other objects.
        """
        labels = self.labels(samples)
        if labels is not None:
            return labels
        labels = self._colors.like_around(samples.grid, samples.colors, seed, self._config.seed_radius)
        if bare:
            return labels
        board = labels == BOARD
        return np.where(board & ~connected(board, samples.grid, seed), np.uint8(OTHER), labels)

    def _around_seed(
        self,
        samples: Samples,
        seed: tuple[int, int],
        down: np.ndarray | None,
        plane: PlaneEstimate,
        prefer: np.ndarray,
    ) -> SurfaceRegion:
        """The surface around a seed that may lie on something printed, with a plane through it to start from.

        A plane may tilt through the surface and a wall close behind it. So it grows outwards from the seed, and is
        fitted once more to the samples of the surface's own colour.
        """
        config, colors, grid, inverse = self._config, self._colors, samples.grid, samples.inverse
        own = np.where(prefer == BOARD, inverse, 0.0)
        start = own if int(np.count_nonzero(own)) >= config.min_samples else inverse
        start = grown_plane(grid, start, seed, plane.inverse_depth, config)
        grown = refit_plane(grid, inverse, prefer, start, down, config, seed=seed)
        plane = grown if isinstance(grown, PlaneEstimate) else plane
        cells = samples_on(samples, plane, seed)
        color = ground_color(samples, cells, seed) if colors.board is None else colors.board
        alike = alike_colors(samples.colors, color)
        # where depth does not separate the surface from a wall close behind it, its light must
        even = evenly_lit(samples, cells & alike, seed) if _flush(cells, inverse) else None
        # in some light a wall may have the surface's colour: the plane is that of the colour itself
        prefer = (
            colors.like(samples.colors, color) if even is None else np.where(even, np.uint8(BOARD), np.uint8(OTHER))
        )
        own = cells & (prefer == BOARD)
        if int(own.sum()) >= config.min_samples:
            again = refit_plane(grid, inverse, prefer, plane.inverse_depth, down, config, seed=middle_cell(own))
            if isinstance(again, PlaneEstimate):
                plane = again
                cells = samples_on(samples, plane, middle_cell(own))
        flush = even is not None or _flush(cells, inverse)
        if even is None and flush:  # noise may hide the wall until the plane is exact
            even = evenly_lit(samples, cells & alike, seed)
        if even is not None:  # other samples of its depth are the wall
            cells, alike = cells & even, alike | even
        elif flush:
            alike = prefer == BOARD
            cells = _without_wall(cells, alike, grid)
        return SurfaceRegion(grid=grid, plane=plane, cells=cells, colored=cells & alike, color=color, by_color=flush)

    def _region(
        self,
        samples: Samples,
        plane: PlaneEstimate,
        cells: np.ndarray,
        color: np.ndarray,
        labels: np.ndarray,
        by_color: bool,
    ) -> SurfaceRegion:
        """The samples on a plane; where a wall may be among them, those that the colours of board and paint enclose.

        A wall may have the board's colour in different light: then only its exact colour counts. If the colour of the
        paint is unknown, nothing is left out, because paint may divide the board; a colour search needs no such care.
        """
        colors, grid, flush = self._colors, samples.grid, _flush(cells, samples.inverse)
        alike = labels == BOARD if flush or colors.light is not None else alike_colors(samples.colors, color)
        enclosed = flush and (by_color or colors.paint is not None)
        if enclosed:
            cells = _without_wall(cells, labels != OTHER, grid)
        return SurfaceRegion(grid=grid, plane=plane, cells=cells, colored=cells & alike, color=color, by_color=enclosed)


def _without_wall(cells: np.ndarray, alike: np.ndarray, grid: CoarseGrid) -> np.ndarray:
    """Samples that depth cannot separate from a wall, within the contour of the surface's colour."""
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
    around = samples[grid.window(seed, config.seed_radius)]
    around = around[np.isfinite(around) & (around > 0.0)]
    if len(around) == 0:
        return "no valid depth around the seed"
    near = float(np.median(around))
    if not low <= near <= high:
        return f"depth of {near:.3g} m at the seed is out of range ({low:g} to {high:g} m)"
    return None
