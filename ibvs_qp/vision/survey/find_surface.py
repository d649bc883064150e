"""The surface around a seed pixel: its plane, the samples on it by depth, and its colour."""

from __future__ import annotations

import cv2
import numpy as np

from ibvs_qp.measurement import RgbdFrame
from ibvs_qp.vision.colors import BOARD, OTHER, SurfaceColors
from ibvs_qp.vision.config import PlaneConfig
from ibvs_qp.vision.grid import CoarseGrid
from ibvs_qp.vision.motion import CameraMotion
from ibvs_qp.vision.plane import PlaneEstimate, PlaneFitter
from ibvs_qp.vision.surface import connected_samples
from ibvs_qp.vision.survey.evenly_lit import evenly_lit
from ibvs_qp.vision.survey.evidence import depth_gate
from ibvs_qp.vision.survey.ground import connected, ground_color
from ibvs_qp.vision.survey.grow import grown_plane
from ibvs_qp.vision.survey.look import SurfaceLook, alike_colors

#: Where more than this share of all readings lies on one plane, a wall may be part of it.
_FLUSH_SHARE = 0.40
#: Share of a new picture in the running colour of a followed surface.
_COLOR_BLEND = 0.2


def find_surface(
    frame: RgbdFrame,
    grid: CoarseGrid,
    fitter: PlaneFitter,
    config: PlaneConfig,
    seed_pixel: tuple[float, float],
    colors: SurfaceColors,
) -> SurfaceLook | str:
    """Fit the surface through a seed, or say why there is none.

    Args:
        frame: Colour and depth.
        grid: Coarse grid of the picture.
        fitter: Plane fit.
        config: Its settings.
        seed_pixel: (u, v) of a place on the surface [px].
        colors: Learns the colour of the surface.
    """
    u, v = seed_pixel
    height, width = frame.depth.shape
    if not (0 <= u < width and 0 <= v < height):
        return f"seed pixel ({u:g}, {v:g}) lies outside the picture of {width} x {height} px"
    rows, columns = grid.shape
    seed = (
        min(max(round((v - grid.offset) / grid.stride), 0), rows - 1),
        min(max(round((u - grid.offset) / grid.stride), 0), columns - 1),
    )
    coarse = grid.sample(frame.rgb)
    inverse = grid.inverse_depth(frame.depth, config.distance_min_m, config.distance_max_m)
    like_seed = colors.like_around(grid, coarse, seed, config.seed_radius) == BOARD
    prefer = np.where(connected(like_seed, grid, seed), np.uint8(BOARD), np.uint8(OTHER))
    plane = fitter.search(grid, inverse, [seed], None, [prefer])
    if isinstance(plane, str):
        return depth_problem(frame.depth, grid, seed, config) or plane
    own = np.where(prefer == BOARD, inverse, 0.0)
    start = own if int(np.count_nonzero(own)) >= config.min_samples else inverse
    start = grown_plane(grid, start, seed, plane.inverse_depth, config)
    grown = fitter.track(grid, inverse, start, None, prefer, seed)
    plane = grown if isinstance(grown, PlaneEstimate) else plane
    cells = _on_plane(grid, inverse, plane, seed)
    color = ground_color(frame.rgb, grid, coarse, cells, seed)
    alike = alike_colors(coarse, color)
    own = cells & alike
    # where depth does not tell the surface from a wall close behind it, its light has to
    even = evenly_lit(frame.rgb, grid, own, seed) if _flush(cells, inverse) else None
    if even is not None:
        alike = even
        own = cells & even
    if int(own.sum()) >= config.min_samples:
        # a plane may tilt through the surface and what lies close behind it; its colour alone does not
        prefer = np.where(alike, np.uint8(BOARD), np.uint8(OTHER))
        again = fitter.track(grid, inverse, plane.inverse_depth, None, prefer, _middle_cell(own))
        if isinstance(again, PlaneEstimate):
            plane = again
            cells = _on_plane(grid, inverse, plane, _middle_cell(own))
    if even is None and _flush(cells, inverse):  # noise may hide the wall until the plane is exact
        even = evenly_lit(frame.rgb, grid, cells & alike, seed)
        alike = alike if even is None else even
    if even is not None:  # what else has its depth is the wall
        cells = cells & even
    colored, by_light = cells & alike, even is not None
    return SurfaceLook(grid=grid, plane=plane, cells=cells, colored=colored, color=color, by_light=by_light)


def follow_surface(
    frame: RgbdFrame,
    grid: CoarseGrid,
    fitter: PlaneFitter,
    config: PlaneConfig,
    before: SurfaceLook,
    motion: CameraMotion | None,
) -> SurfaceLook | str:
    """Fit the surface again where it must be by the camera's motion, or say why that fails."""
    coarse = grid.sample(frame.rgb)
    inverse = grid.inverse_depth(frame.depth, config.distance_min_m, config.distance_max_m)
    predicted = before.plane.inverse_depth if motion is None else motion.plane(before.plane.inverse_depth)
    seed = _middle_cell(before.cells)
    prefer = np.where(alike_colors(coarse, before.color), np.uint8(BOARD), np.uint8(OTHER))
    plane = fitter.track(grid, inverse, predicted, None, prefer, seed)
    if isinstance(plane, str):
        return plane
    cells = _on_plane(grid, inverse, plane, seed)
    if int(cells.sum()) < config.lost_share * int(before.cells.sum()):
        return "the surface was lost"
    color = before.color
    own = cells & (prefer == BOARD)
    if int(own.sum()) >= config.min_samples:
        color = color + _COLOR_BLEND * (np.median(coarse[own].astype(float), axis=0) - color)
    return SurfaceLook(grid=grid, plane=plane, cells=cells, colored=cells & alike_colors(coarse, color), color=color)


def _flush(cells: np.ndarray, inverse: np.ndarray) -> bool:
    """Whether so much lies on the surface's plane that a wall may be part of it."""
    return int(cells.sum()) > _FLUSH_SHARE * int(np.count_nonzero(inverse))


def _middle_cell(cells: np.ndarray) -> tuple[int, int]:
    """The sample of a region that lies deepest within it."""
    depth = cv2.distanceTransform(cells.astype(np.uint8), cv2.DIST_L1, 3)
    row, column = np.unravel_index(int(np.argmax(depth)), cells.shape)
    return int(row), int(column)


def _on_plane(grid: CoarseGrid, inverse: np.ndarray, plane: PlaneEstimate, seed: tuple[int, int] | None) -> np.ndarray:
    """Connected samples on a plane by depth alone, bool (rows, columns)."""
    predicted = np.maximum((grid.design @ plane.inverse_depth).reshape(grid.shape), 1e-6)
    relative = np.where(inverse > 0.0, inverse / predicted - 1.0, np.inf)
    cells = connected_samples(np.abs(relative) < depth_gate(plane), grid, seed)
    return cells if cells.any() else plane.component


def end_band(look: SurfaceLook, width: int) -> np.ndarray:
    """Samples near the end of the surface, by depth or by colour, bool (rows, columns)."""
    kernel = np.ones((2 * width + 1, 2 * width + 1), np.uint8)
    band = np.zeros(look.cells.shape, bool)
    for region in (look.cells, look.colored):
        whole = filled(region)
        band |= (cv2.dilate(whole, kernel) > 0) & (cv2.erode(whole, kernel, borderValue=1) == 0)
    return band


def filled(region: np.ndarray) -> np.ndarray:
    """The region without the holes that prints and missing depth leave in it, uint8."""
    closed = cv2.morphologyEx(region.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8))
    outlines, _ = cv2.findContours(closed, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    filled = np.zeros_like(closed)
    if outlines:
        cv2.drawContours(filled, [max(outlines, key=cv2.contourArea)], -1, 1, -1)
    return np.maximum(filled, closed)


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
