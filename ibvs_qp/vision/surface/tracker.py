"""The surface from picture to picture: followed on a sparser grid, searched anew when it is lost, with its colour."""

from __future__ import annotations

import dataclasses
import functools

import cv2
import numpy as np

from ibvs_qp.measurement import RgbdFrame
from ibvs_qp.vision.appearance.colors import BOARD, OTHER, SurfaceColors, alike_colors
from ibvs_qp.vision.config import PlaneConfig
from ibvs_qp.vision.picture.layout import CoarseGrid, PictureLayout, Samples
from ibvs_qp.vision.surface.ground import evenly_lit, ground_color
from ibvs_qp.vision.surface.plane import (
    PlaneEstimate,
    SurfaceRegion,
    connected,
    filled,
    middle_cell,
    on_surface,
    refit_plane,
    samples_on,
)
from ibvs_qp.vision.surface.search import PlaneSearch, facing, grown_plane

#: Where more than this fraction of all readings lies on one plane, a wall may be part of it.
_FLUSH_SHARE = 0.40


class SurfaceTracker:
    """Plane and region of one camera's surface.

    Args:
        config: Settings of the plane.
        colors: Colours of board and paint; learned at every search for lines.

    Attributes:
        plane: In the last picture, None if it is unknown.
        region: At the last search, None before the first.
    """

    def __init__(self, config: PlaneConfig, colors: SurfaceColors) -> None:
        self._config, self._colors, self._finder = config, colors, SurfaceFinder(config, colors)
        self.reset()

    def reset(self) -> None:
        """Start again as new."""
        self._finder.reset()
        self.plane: PlaneEstimate | None = None
        self.region: SurfaceRegion | None = None

    def lose(self) -> None:
        """The next picture searches the surface."""
        self.plane = None

    def update(
        self,
        frame: RgbdFrame,
        layout: PictureLayout,
        predicted: np.ndarray | None,
        down: np.ndarray | None,
        seed_pixel: tuple[float, float] | None,
    ) -> str | None:
        """Follow the surface or search it; returns the reason when it is missing.

        Args:
            frame: Colour and depth.
            layout: Grid and seeds of the picture.
            predicted: Inverse depth of the followed plane in this picture, (3,); None where none is followed.
            down: Gravity's direction in C, unit, (3,), or None if unknown.
            seed_pixel: (u, v) of a place on the surface [px], for a search; None for the places beside the brush.
        """
        self.plane = None if predicted is None else self._followed(frame, layout, predicted, down)
        if self.plane is not None:
            return None
        if seed_pixel is None:
            seeds = facing(layout.grid, frame.depth, layout.ladder, self._config)
        else:
            (u, v), (height, width) = seed_pixel, frame.depth.shape
            if not (0 <= u < width and 0 <= v < height):
                return f"seed pixel ({u:g}, {v:g}) lies outside the picture of {width} x {height} px"
            row, column, _ = layout.grid.cells_at(u, v)
            seeds = [(int(row), int(column))]
        found = self._finder.find(frame, layout.grid, seeds, down, bare=seed_pixel is None)
        if isinstance(found, str):
            return found
        self.plane, self.region = found.plane, found
        return None

    def _followed(
        self, frame: RgbdFrame, layout: PictureLayout, predicted: np.ndarray, down: np.ndarray | None
    ) -> PlaneEstimate | None:
        """The surface refitted around its prediction on few samples; None if too little of it is left."""
        before, grid, config, colors = self.plane, layout.sparse_grid, self._config, self._colors
        if before is None:
            return None
        inverse = grid.mean_inverse_depth(frame.depth, config)
        labels = None if colors.board is None else colors.label(grid.sample(frame.rgb), *grid.pixels)
        found = refit_plane(grid, inverse, labels, predicted, down, config, sigma=before.residual_sigma)
        least = config.lost_share * before.component.mean()
        return found if isinstance(found, PlaneEstimate) and found.component.mean() >= least else None

    def region_now(self, frame: RgbdFrame, layout: PictureLayout, down: np.ndarray | None) -> SurfaceRegion:
        """The surface on the full coarse grid, for a search of lines; colours and light are learned on it."""
        assert self.plane is not None and self.region is not None  # every plane began with a region
        samples = layout.grid.read(frame, self._config)
        plane = self._whole(self.plane, samples, down)
        self._colors.learn(samples.colors, plane.component)
        if self._light_is_uneven(plane, frame, layout, samples):  # then all of the surface, not its well-lit part alone
            plane = self._refit(plane, samples, down) or plane
        if self.region.plane is not plane:
            self.region = self._finder.follow(samples, plane, self.region)
        return self.region

    def _whole(self, plane: PlaneEstimate, samples: Samples, down: np.ndarray | None) -> PlaneEstimate:
        """The plane on the full coarse grid; it is followed on a sparser one."""
        rows, columns = samples.grid.shape
        if plane.component.shape == (rows, columns):
            return plane
        if (refit := self._refit(plane, samples, down)) is not None:
            return refit
        component = cv2.resize(plane.component.view(np.uint8), (columns, rows), interpolation=cv2.INTER_NEAREST)
        return dataclasses.replace(plane, component=component.astype(bool))

    def _light_is_uneven(self, plane: PlaneEstimate, frame: RgbdFrame, layout: PictureLayout, samples: Samples) -> bool:
        """Learn how light falls on the surface, and how bright the paint is in it; whether the light is uneven."""
        grid, colors, shape = samples.grid, self._colors, (frame.rgb.shape[0], frame.rgb.shape[1])
        near, beside_brush = (
            on_surface(grid, frame.depth, plane.inverse_depth, self._config.fine_gate_high, places)
            for places in (grid.spread, layout.beside_brush)
        )
        tints, places = samples.colors.reshape(-1, 3).take(near, axis=0), grid.design[:, :2].take(near, axis=0)
        uneven = colors.learn_light(tints, places, shape, frame.intrinsics)
        colors.learn_paint(grid, samples.colors, beside_brush)
        return uneven

    def _refit(self, plane: PlaneEstimate, samples: Samples, down: np.ndarray | None) -> PlaneEstimate | None:
        """The plane fitted to the samples of the board's colour in the light that falls on them."""
        labels = self._finder.labels(samples)
        found = refit_plane(samples.grid, samples.inverse, labels, plane.inverse_depth, down, self._config)
        return found if isinstance(found, PlaneEstimate) else None


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
