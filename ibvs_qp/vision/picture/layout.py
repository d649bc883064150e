"""Everything that depends only on picture size and camera: masks of the vehicle, coarse grids, seeds of the surface."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import ArrayLike

from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.frames import R_BODY_CAMERA, to_camera
from ibvs_qp.measurement import RgbdFrame
from ibvs_qp.vision.compilation import kernel
from ibvs_qp.vision.config import REFERENCE_WIDTH, MaskConfig, PlaneConfig, VisionConfig

#: Parts nearer to the camera plane than this are cut off [m]; their image runs out of any picture.
NEAR_M = 0.03
#: Corners of a drawn circle and stations along a rod.
_CORNERS, _STATIONS = 48, 40
#: Sub-pixel bits of the polygon fill.
_SHIFT = 4

Intrinsics = tuple[float, float, float, float]
#: A cell of a grid, (row, column) or steps of them; a place in normalised coordinates.
Cell = tuple[int, int]
Place = tuple[float, float]
#: Whole pixels need no table of fractions.
_WHOLE = np.empty((0, 0), np.uint16)
#: Types that OpenCV can read at places.
_FAST = (np.dtype(np.uint8), np.dtype(np.float32))
#: Samples per row of a search against those of the sparser grid on which a surface is followed: the noise is correlated
#: over 20 px of 640, so that the mean of four neighbours every 16 px is as good as one reading every 8 px.
SPARSER = 2
#: Samples all over the picture for its light, up to twice as many; more cost time and change nothing.
_SPREAD = 600
#: Distances of the seeds from the tip's image, in brush radii: just outside the brush, then farther.
_STEPS = (1.7, 2.6)
#: Farther ones where all of those are hidden or outside the picture; on the other side of the tip, too.
_FAR_STEPS = (4.0, 6.0, 9.0)
#: Where the surface lies from the tip at the beginning of a job, (right, down), unless it is stated.
UP_LEFT = (-1, -1)
#: Depths for which seeds are laid, as multiples of the one before, the nearest and the farthest one [m].
DEPTH_RATIO, _NEAREST_M, _FARTHEST_M = 1.15, 0.05, 2.6


def vehicle_mask(
    vehicle: VehicleParams, brush_width_m: float, config: MaskConfig, intrinsics: Intrinsics, shape: tuple[int, int]
) -> np.ndarray:
    """Pixels hidden by the vehicle itself, 255 there, uint8 (H, W).

    Args:
        vehicle: Geometry of arm, tip, camera and rotors.
        brush_width_m: Diameter of the round brush [m].
        config: Brush length and margin.
        intrinsics: (fx, fy, cx, cy) [px].
        shape: (height, width) of the picture [px].
    """
    mask = np.zeros(shape, np.uint8)
    _fill_rod(mask, vehicle, intrinsics, vehicle.tip_position_m[0], vehicle.arm_radius_m)
    _fill_rod(mask, vehicle, intrinsics, config.brush_length_m, 0.5 * brush_width_m)
    grown = _grow(mask, config.margin_px * shape[1] / REFERENCE_WIDTH)
    return grown | propeller_mask(vehicle, config, intrinsics, shape)


def propeller_mask(
    vehicle: VehicleParams, config: MaskConfig, intrinsics: Intrinsics, shape: tuple[int, int]
) -> np.ndarray:
    """The part of `vehicle_mask` that its propellers hide."""
    mask = np.zeros(shape, np.uint8)
    for hub, thrust_axis in zip(vehicle.geometry.positions, vehicle.geometry.axes, strict=True):
        _fill_hull(mask, _project(hub + _circle(thrust_axis, vehicle.propeller_radius_m), vehicle, intrinsics))
    return _grow(mask, config.margin_px * shape[1] / REFERENCE_WIDTH)


def brush_zone(
    vehicle: VehicleParams, brush_width_m: float, config: MaskConfig, intrinsics: Intrinsics, shape: tuple[int, int]
) -> np.ndarray:
    """Pixels of the brush grown by the margin within which fresh paint appears, uint8 (H, W)."""
    zone = np.zeros(shape, np.uint8)
    _fill_rod(zone, vehicle, intrinsics, config.brush_length_m, 0.5 * brush_width_m)
    return _grow(zone, config.paint_margin_px * shape[1] / REFERENCE_WIDTH)


def _circle(axis: np.ndarray, radius: float) -> np.ndarray:
    """Points of a circle around an axis, seen from its centre, (n, 3)."""
    helper = np.eye(3)[int(np.argmin(np.abs(axis)))]
    first = np.cross(axis, helper)
    first /= np.linalg.norm(first)
    angle = np.linspace(0.0, 2.0 * np.pi, _CORNERS, endpoint=False)[:, None]
    return radius * (np.cos(angle) * first + np.sin(angle) * np.cross(axis, first))


def _project(points: np.ndarray, vehicle: VehicleParams, intrinsics: Intrinsics) -> np.ndarray:
    """Pixels of the body points in front of the camera, (m, 2)."""
    camera = (points - np.asarray(vehicle.camera_position_m, float)) @ R_BODY_CAMERA
    camera = camera[camera[:, 2] > NEAR_M]
    fx, fy, cx, cy = intrinsics
    return np.column_stack((fx * camera[:, 0] / camera[:, 2] + cx, fy * camera[:, 1] / camera[:, 2] + cy))


def _fill_rod(mask: np.ndarray, vehicle: VehicleParams, intrinsics: Intrinsics, length_m: float, radius: float) -> None:
    """Fill the image of a round rod up to the tip: hulls of neighbouring cross sections keep the perspective."""
    end = np.asarray(vehicle.tip_position_m, float)
    start = end - length_m * np.array([1.0, 0.0, 0.0])
    circle = _circle((end - start) / max(float(np.linalg.norm(end - start)), 1e-9), radius)
    stations = [start + share * (end - start) + circle for share in np.linspace(0.0, 1.0, _STATIONS)]
    for one, two in itertools.pairwise([_project(station, vehicle, intrinsics) for station in stations]):
        _fill_hull(mask, np.vstack((one, two)))


def _fill_hull(mask: np.ndarray, pixels: np.ndarray) -> None:
    if len(pixels) < 3:
        return
    limit = 8.0 * max(mask.shape)  # far outside: keeps the fixed-point polygon fill from overflowing
    hull = cv2.convexHull(np.clip(pixels, -limit, limit).astype(np.float32))
    cv2.fillConvexPoly(mask, np.round(hull * (1 << _SHIFT)).astype(np.int32), 255, shift=_SHIFT)


def _grow(mask: np.ndarray, margin: float) -> np.ndarray:
    """The mask with a margin [px]; in cells where the picture is wider than the reference, which hide a little more.

    The dilation's cost grows with the fourth power of the width: 0.3 s at 1920, 25 s at 4096 pixels.
    """
    rows, columns = mask.shape
    cell = math.ceil(columns / REFERENCE_WIDTH)
    if cell > 1:
        padded = cv2.copyMakeBorder(mask, 0, -rows % cell, 0, -columns % cell, cv2.BORDER_CONSTANT)
        height, width = padded.shape
        means = cv2.resize(padded, (width // cell, height // cell), interpolation=cv2.INTER_AREA)
        grown = _grow(np.where(means > 0, np.uint8(255), np.uint8(0)), margin / cell)
        return np.ascontiguousarray(
            cv2.resize(grown, (width, height), interpolation=cv2.INTER_NEAREST)[:rows, :columns]
        )
    size = 2 * round(margin) + 1
    return cv2.dilate(mask, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))) if size > 1 else mask


class CoarseGrid:
    """Sample places of one picture size and camera.

    Attributes:
        stride: Distance of samples [px].
        offset: Place of the first one in row and column [px].
        shape: (rows, columns) of the grid.
        free: Samples the vehicle does not hide, bool (rows, columns).
        pixels: Columns u and rows v of the samples [px], (rows, columns) each.
        design: Columns x, y, 1 in normalised coordinates, (rows * columns, 3).
        corners: The same of the samples' upper left corners, for `mean_inverse_depth`.
    """

    def __init__(self, intrinsics: Intrinsics, mask: np.ndarray, config: PlaneConfig, sparser: int = 1) -> None:
        """Lay the grid over a picture with its vehicle mask (H, W), by a factor sparser than stated."""
        height, width = mask.shape
        self._range_m = float(config.distance_min_m), float(config.distance_max_m)
        self.stride = max(1, round(width / (config.grid_columns // sparser)))
        self.offset, self.intrinsics = self.stride // 2, intrinsics
        fx, fy, cx, cy = intrinsics
        u, v = np.arange(self.offset, width, self.stride), np.arange(self.offset, height, self.stride)
        self.shape = (len(v), len(u))
        x, y = np.meshgrid((u - cx) / fx, (v - cy) / fy)
        self.design = np.column_stack((x.ravel(), y.ravel(), np.ones(x.size)))
        self.corners = self.design - (0.5 / fx, 0.5 / fy, 0.0)
        self.pixels = along, across = np.meshgrid(u, v)
        self._places = np.stack((along, across), axis=2).astype(np.int16)
        self.free = self.sample(mask) == 0

    @cached_property
    def spread(self) -> np.ndarray:
        """Flat places of evenly spread samples that nothing hides, (n,)."""
        places = np.flatnonzero(self.free)
        return places[:: max(1, len(places) // _SPREAD)]

    def sample(self, picture: np.ndarray) -> np.ndarray:
        """Values of a picture at the samples, (rows, columns, ...)."""
        if picture.dtype in _FAST:  # three times as fast as numpy's strides
            return cv2.remap(picture, self._places, _WHOLE, cv2.INTER_NEAREST)
        return picture[self.offset :: self.stride, self.offset :: self.stride]

    def inverse_depth(self, depth: np.ndarray) -> np.ndarray:
        """1/Z at the samples [1/m], 0 where the depth is absent, not finite or out of range, (rows, columns)."""
        z = np.asarray(self.sample(depth), np.float32).astype(float)
        usable = (z > self._range_m[0]) & (z < self._range_m[1])
        return np.divide(1.0, z, out=np.zeros(z.shape), where=usable)

    def mean_inverse_depth(self, depth: np.ndarray) -> np.ndarray:
        """1/Z of the mean depth of the four pixels around the upper left corner of each sample, else as above.

        A pixel without a reading pulls the mean far off the surface.
        """
        depth = np.require(depth, np.float32, ("C", "W"))  # the one type of the kernel
        return _mean_inverse(depth, self._places, *self._range_m)

    def cells_at(self, u: ArrayLike, v: ArrayLike) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Rows and columns of the samples nearest to pixels, the border's beyond the grid, and which pixels are not."""
        rows, columns = self.shape
        row, column = (np.rint((np.asarray(at, float) - self.offset) / self.stride).astype(np.intp) for at in (v, u))
        inside = (row >= 0) & (row < rows) & (column >= 0) & (column < columns)
        return np.minimum(np.maximum(row, 0), rows - 1), np.minimum(np.maximum(column, 0), columns - 1), inside

    def window(self, cell: tuple[int, int], radius: int) -> tuple[slice, slice]:
        """Slices of the square window around a cell, cut at the border of the grid."""
        rows, columns = (slice(max(at - radius, 0), max(at + radius + 1, 0)) for at in cell)
        return rows, columns

    def windows(self, cells: list[tuple[int, int]], radius: int) -> np.ndarray:
        """Flat places of the windows around cells, those beyond the border moved to it, (n, (2 radius + 1)^2)."""
        steps = np.arange(-radius, radius + 1)
        row, column = np.array(cells).T[:, :, None]
        rows = np.minimum(np.maximum(row + steps, 0), self.shape[0] - 1)
        columns = np.minimum(np.maximum(column + steps, 0), self.shape[1] - 1)
        return (rows[:, :, None] * self.shape[1] + columns[:, None]).reshape(len(cells), -1)


@kernel("f8[:, ::1](f4[:, ::1], i2[:, :, ::1], f8, f8)")
def _mean_inverse(depth, places, nearest, farthest):
    """1/Z of the mean depth around the upper left corners of places (rows, columns, 2), 0 where out of range."""
    (rows, columns, _), quarter = places.shape, np.float32(0.25)
    inverse = np.empty((rows, columns))
    for i in range(rows):
        for j in range(columns):
            right, below = np.int64(places[i, j, 0]), np.int64(places[i, j, 1])
            left, above = max(right - 1, 0), max(below - 1, 0)
            mean = quarter * depth[above, left] + quarter * depth[above, right]
            z = np.float64(mean + quarter * depth[below, left] + quarter * depth[below, right])
            inverse[i, j] = 1.0 / z if nearest < z < farthest else 0.0
    return inverse


class PictureLayout:
    """Masks and grids of one picture size and camera.

    Attributes:
        mask: Vehicle's mask, uint8 (H, W).
        excluded: Where no flow points may lie, at half resolution, uint8: half a window around the vehicle, too.
        grid: Coarse grid.
        sparse_grid: A still coarser one, on which the surface is followed.
        beside_brush: Flat places of the grid's samples around the brush, where fresh paint lies.
        ladder: Cells beside the place where the tip meets a surface, by its depth.
    """

    def __init__(
        self, frame: RgbdFrame, config: VisionConfig, vehicle: VehicleParams | None, inwards: tuple[int, int] = UP_LEFT
    ) -> None:
        """Draw the masks and lay the grids for pictures like this one."""
        shape, intrinsics = (frame.rgb.shape[0], frame.rgb.shape[1]), frame.intrinsics
        self._key = (shape, tuple(intrinsics))
        self.mask = zone = np.zeros(shape, np.uint8)
        if vehicle is not None:
            self.mask = vehicle_mask(vehicle, config.brush_width_m, config.mask, intrinsics, shape)
            zone = brush_zone(vehicle, config.brush_width_m, config.mask, intrinsics, shape)
        hidden = np.asarray(self.mask | zone, np.uint8)[: shape[0] // 2 * 2 : 2, : shape[1] // 2 * 2 : 2]
        # The arm stands still in the picture: no window of a followed point may show its edge.
        window = cv2.getStructuringElement(cv2.MORPH_RECT, (config.flow.window_px, config.flow.window_px))
        self.excluded = np.asarray(cv2.dilate(hidden, window), np.uint8)
        self.grid = CoarseGrid(intrinsics, self.mask, config.plane)
        self.sparse_grid = CoarseGrid(intrinsics, self.mask, config.plane, SPARSER)
        self.beside_brush = np.flatnonzero(self.grid.free & (self.grid.sample(zone) > 0))
        self.ladder: list[Seeds] = []
        if vehicle is not None:
            self.ladder = seeds_ahead(self.grid, vehicle, config.brush_width_m, inwards)

    def fits(self, frame: RgbdFrame) -> bool:
        """Whether a picture has this size and camera."""
        return self._key == ((frame.rgb.shape[0], frame.rgb.shape[1]), tuple(frame.intrinsics))


@dataclass(frozen=True, slots=True)
class Seeds:
    """Cells beside the place where the tip meets a surface, which lies at one depth [m]."""

    depth: float
    cells: list[Cell]


def seeds_ahead(
    grid: CoarseGrid, vehicle: VehicleParams, brush_width_m: float, inwards: tuple[int, int] = UP_LEFT
) -> list[Seeds]:
    """Seeds for a surface in contact, then for farther ones; the vehicle hides none of them.

    They lie beside a brush of some diameter [m], inwards of the place from which a job begins, (right, down): +1 or -1
    each.
    """
    x, y, z = to_camera(np.asarray(vehicle.tip_position_m, float), np.asarray(vehicle.camera_position_m, float))
    nearest = max(z, _NEAREST_M)
    count = 1 + max(math.ceil(math.log(_FARTHEST_M / nearest, DEPTH_RATIO)), 0)
    rungs = [nearest * DEPTH_RATIO**k for k in range(count)]
    radius = 0.5 * brush_width_m
    return [Seeds(z, _beside(grid, (x / z, y / z), radius / z, inwards)) for z in rungs]


def _beside(grid: CoarseGrid, center: Place, radius: float, inwards: Cell) -> list[Cell]:
    """Cells beside a place and inwards of it, else anywhere near; those nearest to the tip first."""
    right, down = inwards
    aside = ((right, 0), (-right, 0), (right, down), (-right, down))
    around = (*aside, (right, -down), (-right, -down), (0, -down), (0, down))
    near = _free_cells(grid, center, radius, _STEPS, aside)
    return near or _free_cells(grid, center, radius, (*_STEPS, *_FAR_STEPS), around)


def _free_cells(
    grid: CoarseGrid, center: Place, radius: float, steps: tuple[float, ...], directions: tuple[Cell, ...]
) -> list[Cell]:
    """Cells at steps of a radius from a normalised place that nothing hides, those of the first step first."""
    fx, fy, cx, cy = grid.intrinsics
    x, y = (c + np.multiply.outer(steps, way) * radius for c, way in zip(center, np.transpose(directions), strict=True))
    rows, columns, inside = grid.cells_at(fx * x + cx, fy * y + cy)
    free = inside & grid.free[rows, columns]
    return list(zip(rows[free].tolist(), columns[free].tolist(), strict=True))
