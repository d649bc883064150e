"""The surface from picture to picture: followed on a sparser grid, searched anew when it is lost, with its colour."""

from __future__ import annotations

import dataclasses
import functools

import cv2
import numpy as np

from ibvs_qp.vision.appearance.colors import BOARD, OTHER, SurfaceColors, alike_colors
from ibvs_qp.vision.appearance.light import shaded_colors
from ibvs_qp.vision.config import PlaneConfig
from ibvs_qp.vision.picture.layout import Cell, CoarseGrid
from ibvs_qp.vision.picture.picture import Picture
from ibvs_qp.vision.surface.plane import (
    PlaneEstimate,
    SurfaceRegion,
    connected,
    filled,
    middle_cell,
    on_surface,
    refit_plane,
    samples_on,
    shaded_samples,
)
from ibvs_qp.vision.surface.search import PlaneSearch, depth_problem, facing, grown_plane

#: Where more than this fraction of all readings lies on one plane, a wall may be part of it.
_FLUSH_SHARE = 0.40
#: Fraction of the surface that must have the colour around the seed for it to be the surface's.
_GROUND_SHARE = 0.25
#: Samples next to the seed's colour among which the most common colour is sought, and colours tried.
_NEAR, _TRIED = 300, 40
#: Even samples from which on a piece may be the surface though it has a smaller part (a square of 98 px at 640).
_PIECE = 150

#: Largest change from one sample to the next within an evenly lit surface, per channel [grey levels].
_STEP = 9
#: A part smaller than this many samples, or than this fraction of the samples with the surface's colour, does not
#: count.
_PART, _PART_SHARE = 150, 0.10
#: Nor does one that is nearly all of it.
_ALL = 0.985
#: Fraction of the samples just beyond the part that must have the surface's colour in some light: beyond prints they do
#: not, beyond an edge towards a wall of nearly the same colour they do.
_ALIKE_BEYOND = 0.4
#: A part that fills this fraction of its convex hull, and this fraction of the samples with the colour, is a surface of
#: its own: joints of a wall and the like have its colour, but are thin.
_SOLID, _SOLID_SHARE = 0.85, 0.3


class SurfaceTracker:
    """Plane and region of one camera's surface.

    Args:
        config: Settings of the plane.
        colors: Colours of board and paint, as far as they are known; learned at every search for lines.

    Attributes:
        plane: In the last picture, None if it is unknown.
        region: At the last search, None before the first.
    """

    def __init__(self, config: PlaneConfig, colors: SurfaceColors) -> None:
        self._config, self._colors, self._search = config, colors, PlaneSearch(config)
        self.reset()

    def reset(self) -> None:
        """Start again as new."""
        self._search.reset()
        self.plane: PlaneEstimate | None = None
        self.region: SurfaceRegion | None = None

    def lose(self) -> None:
        """The next picture searches the surface."""
        self.plane, self._colors.shadowed = None, False

    def find_surface(
        self, picture: Picture, predicted: np.ndarray | None, seed_pixel: tuple[float, float] | None
    ) -> str | None:
        """Follow the surface or search it; returns the reason when it is missing.

        The followed plane is predicted, (a, b, c) in this picture, None if none is followed. A search starts at a pixel
        (u, v) on the surface, None for the places beside the brush.
        """
        self.plane = None if predicted is None else self._followed(picture, predicted)
        if self.plane is not None:
            return None
        if seed_pixel is None:
            seeds = facing(picture.grid, picture.inverse, picture.layout.ladder, self._config.seed_radius)
        else:
            (u, v), (height, width) = seed_pixel, picture.depth.shape
            if not (0 <= u < width and 0 <= v < height):
                return f"seed pixel ({u:g}, {v:g}) lies outside the picture of {width} x {height} px"
            row, column, _ = picture.grid.cells_at(u, v)
            seeds = [(int(row), int(column))]
        found = self._find(picture, seeds, bare=seed_pixel is None)
        if isinstance(found, str):
            return found
        self.plane = found.plane
        self._take(found)
        return None

    def region_now(self, picture: Picture) -> SurfaceRegion:
        """The surface on the full coarse grid, for a search of lines; colours and light are learned on it."""
        assert self.plane is not None and self.region is not None  # every plane began with a region
        plane = self._whole(self.plane, picture)
        self._colors.learn(picture.colors, plane.component)
        places = (picture.grid.spread, picture.layout.beside_brush)
        near = [on_surface(picture, plane.inverse_depth, self._config.fine_gate_high, some) for some in places]
        if self._colors.learn_light(picture, *near):  # then all of the surface, not its well-lit part alone
            plane = self._refit(plane, picture) or plane
        if self.region.plane is not plane:
            self._take(self._follow(picture, plane, self.region))
        return self.region

    def _take(self, region: SurfaceRegion) -> None:
        """Keep a region; where depth does not separate it from a wall, that may look like the board in shade."""
        self.region, self._colors.shadowed = region, region.shadowed and not region.by_color

    def _followed(self, picture: Picture, predicted: np.ndarray) -> PlaneEstimate | None:
        """The surface refitted around its prediction on few samples; None if too little of it is left."""
        before, grid, config, colors = self.plane, picture.layout.sparse_grid, self._config, self._colors
        if before is None:
            return None
        inverse = grid.mean_inverse_depth(picture.depth)
        labels = None if colors.board is None else colors.label(grid.sample(picture.rgb), *grid.pixels)
        found = refit_plane(grid, inverse, labels, predicted, picture.down, config, sigma=before.residual_sigma)
        least = config.lost_share * before.component.mean()
        return found if isinstance(found, PlaneEstimate) and found.component.mean() >= least else None

    def _whole(self, plane: PlaneEstimate, picture: Picture) -> PlaneEstimate:
        """The plane on the full coarse grid; it is followed on a sparser one."""
        rows, columns = picture.grid.shape
        if plane.component.shape == (rows, columns):
            return plane
        if (refit := self._refit(plane, picture)) is not None:
            return refit
        component = cv2.resize(plane.component.view(np.uint8), (columns, rows), interpolation=cv2.INTER_NEAREST)
        return dataclasses.replace(plane, component=component.astype(bool))

    def _refit(self, plane: PlaneEstimate, picture: Picture) -> PlaneEstimate | None:
        """The plane fitted to the samples of the board's colour in the light that falls on them."""
        start, labels = plane.inverse_depth, self._board_labels(picture)
        found = refit_plane(picture.grid, picture.inverse, labels, start, picture.down, self._config)
        return found if isinstance(found, PlaneEstimate) else None

    def _follow(self, picture: Picture, plane: PlaneEstimate, before: SurfaceRegion) -> SurfaceRegion:
        """The samples of a surface whose plane, on this grid, is known; `before` is the region so far."""
        colors, cells = self._colors, samples_on(picture, plane, middle_cell(plane.component))
        color, labels = before.color, self._board_labels(picture)
        if labels is None:
            labels = colors.like(picture.colors, color)
        elif colors.board is not None:
            color = colors.board
        return self._region(picture, plane, cells, color, labels, before.by_color)

    def _find(self, picture: Picture, seeds: list[Cell], bare: bool) -> SurfaceRegion | str:
        """Fit the surface through one of the cells on which it may lie, or return why it is missing.

        If the seeds are bare, nothing is printed or painted where they lie.
        """
        colors = self._colors
        if colors.board is None:
            seeds = colors.bare(picture.grid, picture.colors, seeds, self._config.seed_radius)
        labels = functools.cache(lambda index: self._labels(picture, seeds[index], bare))  # mostly of the first alone
        plane = self._search.search_plane(picture.grid, picture.inverse, seeds, picture.down, labels)
        if isinstance(plane, str):
            return (depth_problem(picture.depth, picture.grid, seeds[0], self._config) if seeds else None) or plane
        index = next((index for index, seed in enumerate(seeds) if plane.component[seed]), 0)
        if not bare:
            return self._around_seed(picture, seeds[index], plane, labels(index))
        color = colors.board
        if color is None:
            color = np.median(picture.colors[(labels(index) == BOARD) & plane.component].astype(float), axis=0)
        cells = samples_on(picture, plane, seeds[index])
        return self._region(picture, plane, cells, color, colors.like(picture.colors, color), by_color=False)

    def _board_labels(self, picture: Picture) -> np.ndarray | None:
        """Labels of the samples by the board's colour in their light, uint8 (rows, columns); None if it is unknown."""
        return None if self._colors.board is None else self._colors.label(picture.colors, *picture.grid.pixels)

    def _labels(self, picture: Picture, seed: Cell, bare: bool) -> np.ndarray:
        """Labels of the samples: by the board's colour, before it is known by that of the seed.

        A seed may lie on something printed: then parts apart from it are other objects.
        """
        labels = self._board_labels(picture)
        if labels is not None:
            return labels
        labels = self._colors.like_around(picture.grid, picture.colors, seed, self._config.seed_radius)
        if bare:
            return labels
        board = labels == BOARD
        return np.where(board & ~connected(board, picture.grid, seed), np.uint8(OTHER), labels)

    def _around_seed(self, picture: Picture, seed: Cell, plane: PlaneEstimate, prefer: np.ndarray) -> SurfaceRegion:
        """The surface around a seed that may lie on something printed, with a plane through it to start from.

        A plane may tilt through the surface and a wall close behind it. So it grows outwards from the seed, and is
        fitted once more to the samples of the surface's own colour.
        """
        config, colors, grid, inverse, down = self._config, self._colors, picture.grid, picture.inverse, picture.down
        own = np.where(prefer == BOARD, inverse, 0.0)
        start = own if int(np.count_nonzero(own)) >= config.min_samples else inverse
        start = grown_plane(grid, start, seed, plane.inverse_depth, config)
        grown = refit_plane(grid, inverse, prefer, start, down, config, seed=seed)
        plane = grown if isinstance(grown, PlaneEstimate) else plane
        cells = samples_on(picture, plane, seed)
        color = ground_color(picture, cells, seed) if colors.board is None else colors.board
        alike = alike_colors(picture.colors, color)
        shade = shaded_samples(picture, plane.inverse_depth, cells, alike, color)
        # where depth does not separate the surface from a wall close behind it, its light must
        even = evenly_lit(picture, cells & alike, seed) if shade is None and _flush(cells, inverse) else None
        # in some light a wall may have the surface's colour: the plane is that of the colour itself
        prefer = colors.like(picture.colors, color)
        if even is not None:
            prefer = np.where(even, np.uint8(BOARD), np.uint8(OTHER))
        if shade is not None:
            prefer = np.where(shade, np.uint8(BOARD), prefer)
        own = cells & (prefer == BOARD)
        if int(own.sum()) >= config.min_samples:
            again = refit_plane(grid, inverse, prefer, plane.inverse_depth, down, config, seed=middle_cell(own))
            if isinstance(again, PlaneEstimate):
                plane = again
                cells = samples_on(picture, plane, middle_cell(own))
        if shade is not None:
            alike = alike | shaded_colors(picture.colors, color)
        flush = even is not None or _flush(cells, inverse)
        if even is None and shade is None and flush:  # noise may hide the wall until the plane is exact
            even = evenly_lit(picture, cells & alike, seed)
        if even is not None:  # other samples of its depth are the wall
            cells, alike = cells & even, alike | even
        elif flush:
            alike = (prefer == BOARD) if shade is None else alike
            cells = _without_wall(cells, alike, grid)
        return SurfaceRegion(
            plane=plane,
            cells=cells,
            colored=cells & alike,
            color=color,
            by_color=flush,
            shadowed=shade is not None,
        )

    def _region(
        self,
        picture: Picture,
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
        colors, grid, flush = self._colors, picture.grid, _flush(cells, picture.inverse)
        alike = labels == BOARD if flush or colors.light is not None else alike_colors(picture.colors, color)
        shade = shaded_samples(picture, plane.inverse_depth, cells, labels != OTHER, color)
        if shade is not None:
            alike, labels = alike | shade, np.where(shade, np.uint8(BOARD), labels)
        enclosed = flush and (by_color or colors.paint is not None)
        if enclosed:
            cells = _without_wall(cells, labels != OTHER, grid)
        return SurfaceRegion(
            plane=plane,
            cells=cells,
            colored=cells & alike,
            color=color,
            by_color=enclosed,
            shadowed=shade is not None,
        )


def _without_wall(cells: np.ndarray, alike: np.ndarray, grid: CoarseGrid) -> np.ndarray:
    """Samples that depth cannot separate from a wall, within the contour of the surface's colour."""
    own = cells & alike
    return cells & (filled(connected(own, grid, middle_cell(own))) > 0) if own.any() else cells


def _flush(cells: np.ndarray, inverse: np.ndarray) -> bool:
    """Whether so much lies on the surface's plane that a wall may be part of it."""
    return int(cells.sum()) > _FLUSH_SHARE * int(np.count_nonzero(inverse))


def ground_color(picture: Picture, cells: np.ndarray, seed: Cell) -> np.ndarray:
    """Colour of the bare surface, RGB (3,): that around the seed where it covers much, else the most common near by.

    A seed may lie on something printed or painted, and a wall close behind the surface may outnumber it. Paint
    lies on a ground that is a larger even piece than itself; a small board before a wall of bricks does not.
    The surface's samples by depth are bool (rows, columns).
    """
    grid, coarse = picture.grid, picture.colors
    rows, columns = grid.window(seed, 1)
    around = np.median(coarse[rows, columns].reshape(-1, 3).astype(float), axis=0)
    alike = cells & alike_colors(coarse, around)
    region = connected(alike, grid, seed)
    if int(region.sum()) >= _GROUND_SHARE * int(cells.sum()):
        return np.median(coarse[region].astype(float), axis=0)
    others = np.argwhere(cells & ~region)
    near = others[np.argsort(((others - seed) ** 2).sum(axis=1), kind="stable")[:_NEAR]]
    colors = coarse[tuple(near.T)].astype(float) if len(near) else coarse[cells].astype(float)
    tried = colors[:: max(1, len(colors) // _TRIED)]
    counts = [int(alike_colors(colors, color).sum()) for color in tried]
    ground = np.median(colors[alike_colors(colors, tried[int(np.argmax(counts))])], axis=0)
    even = _even_places(picture)
    piece = int((region & even).sum())
    if piece >= _PIECE and piece > _largest(cells & ~region & even & alike_colors(coarse, ground)):
        return np.median(coarse[region].astype(float), axis=0)
    return ground


def _largest(region: np.ndarray) -> int:
    """Number of samples of the largest piece of a region."""
    _, pieces = cv2.connectedComponents(region.astype(np.uint8), connectivity=4)
    return int(np.bincount(pieces[region]).max()) if region.any() else 0


def evenly_lit(picture: Picture, own: np.ndarray, seed: Cell) -> np.ndarray | None:
    """The part of the apparent surface that its light joins to the seed, where that ends at a real edge.

    Given and returned are samples, bool (rows, columns): those with the depth and, in some light, the colour of the
    surface, and the part; None where all of them are joined, or nothing is certain.
    """
    rows, columns = own.shape
    if not own.any():
        return None
    smooth = _averaged(picture)
    # beside other things, such as paint under the seed, a sample's square has part of their colour
    inner = cv2.erode(own.astype(np.uint8), np.ones((3, 3), np.uint8))
    places = np.argwhere(inner if inner.any() else own)
    start = places[int(np.argmin(((places - seed) ** 2).sum(axis=1)))]
    blocked = np.ones((rows + 2, columns + 2), np.uint8)
    blocked[1:-1, 1:-1] = ~own
    step = (_STEP, _STEP, _STEP)
    point = (int(start[1]), int(start[0]))
    cv2.floodFill(smooth, blocked, point, (0, 0, 0), step, step, 4 | cv2.FLOODFILL_MASK_ONLY | (2 << 8))
    part = blocked[1:-1, 1:-1] == 2
    count, total = int(part.sum()), int(own.sum())
    if count < max(_PART, _PART_SHARE * total) or count > _ALL * total:
        return None
    closed = cv2.morphologyEx(part.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8))
    outlines, _ = cv2.findContours(closed, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    outline = max(outlines, key=cv2.contourArea)
    cv2.drawContours(closed, [outline], -1, 1, -1)
    hull = np.zeros_like(closed)
    cv2.fillConvexPoly(hull, cv2.convexHull(outline), 1)
    solid = int(closed.sum()) >= max(_SOLID * int(hull.sum()), _SOLID_SHARE * total)
    ring = (cv2.dilate(closed, np.ones((5, 5), np.uint8)) > 0) & (cv2.dilate(closed, np.ones((3, 3), np.uint8)) == 0)
    if solid or (ring.any() and float(own[ring].mean()) >= _ALIKE_BEYOND):
        return (closed > 0) & own
    return None


def _even_places(picture: Picture) -> np.ndarray:
    """Samples around which light and colour change slowly, bool (rows, columns)."""
    smooth, kernel = _averaged(picture), np.ones((3, 3), np.uint8)
    return (cv2.dilate(smooth, kernel) - cv2.erode(smooth, kernel)).max(axis=2) <= 2 * _STEP


def _averaged(picture: Picture) -> np.ndarray:
    """Mean colours of the squares around samples, uint8 (rows, columns, 3)."""
    rgb, grid = picture.rgb, picture.grid
    rows, columns = grid.shape
    size = (columns * grid.stride, rows * grid.stride)
    padded = cv2.copyMakeBorder(
        rgb, 0, max(size[1] - rgb.shape[0], 0), 0, max(size[0] - rgb.shape[1], 0), cv2.BORDER_REPLICATE
    )
    return np.ascontiguousarray(cv2.resize(padded[: size[1], : size[0]], (columns, rows), interpolation=cv2.INTER_AREA))
