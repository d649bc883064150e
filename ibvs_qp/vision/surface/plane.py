"""The working surface as a plane in inverse depth, 1/Z = a x + b y + c, and the samples of a picture on it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np

from ibvs_qp.vision.appearance.colors import BOARD, PAINT
from ibvs_qp.vision.appearance.light import shaded_colors
from ibvs_qp.vision.compilation import MAD_TO_SIGMA, kernel, median
from ibvs_qp.vision.config import PlaneConfig
from ibvs_qp.vision.picture.layout import SPARSER, CoarseGrid
from ibvs_qp.vision.picture.picture import Picture

#: Gate of samples that look like paint in either round, fraction of the board's: a wall that looks like paint must not
#: get in, so such samples count in the last round of a search only, and have to fit twice as well. For a followed
#: surface half of the first gate (1.25 % of depth), and more than two sigmas of the last one, lie well within 4 %, a
#: gap of 0.02 m at 0.5 m.
_PAINT_SEARCHED, _PAINT_FOLLOWED = (0.0, 0.5), (0.5, 0.75)
#: Side of the blocks over which residuals are averaged to measure their correlation [samples of a search].
_BLOCK = 8
#: Samples used to measure the spread of residuals; more cost time and change nothing.
_SPREAD = 400
#: Smallest determinant of the normal matrix, fraction of the product of its diagonal.
_FLAT = 1e-6
#: Planes are held in front of the camera: least 1/Z [1/m].
_FARTHEST = 1e-3
#: Least part of the surface in shadow, and samples along the shadow's edge, within so many cells of it; their mean
#: depth differs by less than this fraction: a board 1 cm before a wall, seen from 1 m, has 1 %.
_SHADED_SHARE, _LEAST_EDGE, _NEAR_SHADE, _SHADE_STEP = 0.03, 12, 2, 0.006
_NO_LABELS = np.empty(0, np.uint8)
#: A reading within this fraction of depth is on the surface at least and at most; three sigmas of the fit between.
_GATE_LOW, _GATE_HIGH, _GATE_SIGMAS = 0.010, 0.022, 3.0


@dataclass(frozen=True, kw_only=True)
class PlaneEstimate:
    """A fitted surface in the camera frame."""

    inverse_depth: np.ndarray  # (a, b, c) of 1/Z = a x + b y + c [1/m], (3,)
    covariance: np.ndarray  # of (a, b, c), correlated noise and the frame's common mode included, (3, 3)
    normal: np.ndarray  # outward unit normal (towards the camera) in C, (3,)
    distance_m: float  # distance of the camera centre from the plane [m]
    inlier_share: float  # fraction of the valid samples of the whole picture that belong to the surface
    residual_sigma: float  # standard deviation of the residuals, fraction of depth
    component: np.ndarray  # samples of the surface, bool (rows, columns) of the coarse grid

    @property
    def abcd(self) -> tuple[float, float, float, float]:
        """Plane (A, B, C, D) with D = -1."""
        a, b, c = (float(entry) for entry in self.inverse_depth)
        return a, b, c, -1.0


def refit_plane(
    grid: CoarseGrid,
    inverse: np.ndarray,
    labels: np.ndarray | None,
    start: np.ndarray,
    down: np.ndarray | None,
    config: PlaneConfig,
    *,
    sigma: float | None = None,
    seed: tuple[int, int] | None = None,
) -> PlaneEstimate | str:
    """Two rounds of least squares on one grid, each within a gate.

    Args:
        grid: Where the samples lie.
        inverse: 1/Z of the samples [1/m], 0 where absent, (rows, columns); means if the surface is followed.
        labels: Colour labels of the samples, uint8 (rows, columns), or None.
        start: (a, b, c) to start from, (3,).
        down: Gravity's direction in C, unit, (3,), or None if unknown.
        config: Gates and limits.
        sigma: Spread of the residuals of a followed surface, fraction of depth, which sets the last gate; None measures
            it in each round.
        seed: The surface is the part around this sample; None takes the largest.

    Returns:
        The surface, or the reason why it is missing.
    """
    searched = sigma is None
    design, block, paint_gates = grid.design, _BLOCK, _PAINT_SEARCHED
    least = config.min_samples
    if not searched:
        design, block, paint_gates = grid.corners, _BLOCK // SPARSER, _PAINT_FOLLOWED
        least = max(config.min_samples // SPARSER**2, 3)
    flat = np.ascontiguousarray(inverse, float).reshape(-1)
    colors = _NO_LABELS if labels is None else np.ascontiguousarray(labels).reshape(-1)
    usable = (flat > 0.0) & grid.free.reshape(-1)
    seen = int(np.count_nonzero(usable))
    if seen < least:
        return "too few valid depth samples"
    plane, gate, spread = np.array(start, float), config.coarse_gate, sigma or 0.0
    normal_matrix_inverse, component, count = np.empty((3, 3)), grid.free, 0
    for last in (False, True):
        relative, near = choose_samples(design, flat, usable, colors, plane, searched, gate, paint_gates[last], least)
        if last and not searched:  # before the last gate, which would make the spread look smaller
            spread = MAD_TO_SIGMA * median(np.abs(relative[component.reshape(-1)]))
        component = near.reshape(grid.shape)
        if last or searched:
            component = connected_samples(component, grid, seed)
        count = int(np.count_nonzero(component))
        if count < least:
            noise = depth_noise(flat.reshape(grid.shape))
            if noise > config.sound_scatter and np.count_nonzero(near) >= least:
                return f"depth scatters by {100.0 * noise:.1f} % from sample to sample: no surface holds together"
            return "too few samples on the surface"
        solved, plane, normal_matrix_inverse = fit_plane(design, flat, component.reshape(-1))
        if not solved:
            return "samples on the surface lie on one line"
        if searched:
            some = relative[component.reshape(-1)][:: max(1, count // _SPREAD)]
            spread = MAD_TO_SIGMA * median(np.abs(some - median(some)))
        gate = config.fine_gate_sigmas * (spread if sigma is None else sigma)
        gate = min(max(gate, config.fine_gate_low), config.fine_gate_high)
    length = math.hypot(*plane.tolist())
    upright = float(plane[2]) > math.cos(math.radians(config.max_oblique_deg)) * length
    if down is not None:
        upright &= abs(float(plane @ down)) < math.sin(math.radians(config.max_lean_deg)) * length
    if not upright:
        return "the surface does not stand upright or does not face the camera"
    if not config.distance_min_m <= 1.0 / length <= config.distance_max_m:
        return f"the surface lies {1.0 / length:.2f} m away, out of range"
    # residuals that hold together over blocks inflate the covariance of least squares; plus the frame's common mode
    total, blocks = residual_squares(design, flat, component, plane, block)
    inflation = max(1.0, blocks / total) if total > 0.0 else 1.0
    variance = total / max(count - 3.0, 1.0) * inflation
    common = config.common_mode_m**2 * float(plane @ plane)
    return PlaneEstimate(
        inverse_depth=plane,
        covariance=normal_matrix_inverse * variance + plane[:, None] * plane * common,
        normal=plane * (-1.0 / length),
        distance_m=1.0 / length,
        inlier_share=count / seen,
        residual_sigma=spread,
        component=component,
    )


def connected_samples(inlier: np.ndarray, grid: CoarseGrid, seed: tuple[int, int] | None) -> np.ndarray:
    """Connected inliers around the seed (the largest, without one); hidden samples connect."""
    _, labels = cv2.connectedComponents((inlier | ~grid.free).view(np.uint8), connectivity=4, ltype=cv2.CV_16U)
    if seed is not None:
        rows, columns = grid.window(seed, 2)
        around = labels[rows, columns][inlier[rows, columns]]
        counts = np.bincount(around) if len(around) else np.zeros(1)
    else:
        counts = np.bincount(labels.ravel().take(np.flatnonzero(inlier)), minlength=1)
    label = int(np.argmax(counts))
    return inlier & (labels == label) if counts[label] > 0 else np.zeros_like(inlier)


def depth_noise(inverse: np.ndarray) -> float:
    r"""Noise of single depth samples by their second differences along rows, which are zero on every plane.

    .. math:: \sigma = \frac{1.4826}{\sqrt 6} \operatorname{median} \frac{|w_{k-1} - 2 w_k + w_{k+1}|}{w_k}

    Args:
        inverse: 1/Z of the samples w [1/m], 0 where absent, (rows, columns).

    Returns:
        Standard deviation as a fraction of depth [-]; 0 where no three samples lie side by side.
    """
    left, middle, right = inverse[:, :-2], inverse[:, 1:-1], inverse[:, 2:]
    there = (left > 0.0) & (middle > 0.0) & (right > 0.0)
    bends = np.abs(left - 2.0 * middle + right)[there] / middle[there]
    return MAD_TO_SIGMA / math.sqrt(6.0) * median(bends) if bends.size else 0.0


@kernel("Tuple((f8[::1], b1[::1]))(f8[:, ::1], f8[::1], b1[::1], u1[::1], f8[::1], b1, f8, f8, i8)")
def choose_samples(design, inverse, usable, labels, plane, own_depth, gate, paint_gate, least):
    """Usable samples (n,) within a gate of a plane, those of the surface's colours alone where at least so many are.

    Samples that look like paint count within a fraction of the gate. Distances are fractions of the samples' own depth
    or the plane's, undefined where not usable; returned with the chosen samples, (n,) each.
    """
    relative = np.empty(len(inverse))
    near = np.zeros(len(inverse), np.bool_)
    colored = np.zeros(len(inverse), np.bool_)
    count = 0
    for i in range(len(inverse)):
        if not usable[i]:
            continue
        at = design[i, 0] * plane[0] + design[i, 1] * plane[1] + design[i, 2] * plane[2]
        relative[i] = (inverse[i] / max(at, _FARTHEST) if own_depth else at / inverse[i]) - 1.0
        away = abs(relative[i])
        near[i] = away < gate
        if near[i] and labels.size > 0:
            colored[i] = labels[i] == BOARD or (labels[i] == PAINT and away < paint_gate * gate)
            count += colored[i]
    return relative, colored if labels.size > 0 and count >= least else near


@kernel("Tuple((b1, f8[::1], f8[:, ::1]))(f8[:, ::1], f8[::1], b1[::1])")
def fit_plane(design, inverse, chosen):
    """Least squares over chosen samples, by cofactors.

    Returns whether the samples determine a plane, (a, b, c), (3,), and the inverse of the normal matrix, (3, 3).
    """
    xx = xy = x = yy = y = one = xd = yd = d = 0.0
    for i in range(len(inverse)):
        if not chosen[i]:
            continue
        u, v, w = design[i, 0], design[i, 1], inverse[i]
        xx, xy, x, yy, y, one = xx + u * u, xy + u * v, x + u, yy + v * v, y + v, one + 1.0
        xd, yd, d = xd + u * w, yd + v * w, d + w
    normal = np.empty((3, 3))
    normal[0, 0] = yy * one - y * y
    normal[0, 1] = normal[1, 0] = x * y - xy * one
    normal[0, 2] = normal[2, 0] = xy * y - x * yy
    normal[1, 1] = xx * one - x * x
    normal[1, 2] = normal[2, 1] = xy * x - xx * y
    normal[2, 2] = xx * yy - xy * xy
    determinant = xx * normal[0, 0] + xy * normal[0, 1] + x * normal[0, 2]
    scale, plane = 1.0 / determinant, np.empty(3)
    for row in range(3):
        for column in range(3):
            normal[row, column] *= scale
        plane[row] = normal[row, 0] * xd + normal[row, 1] * yd + normal[row, 2] * d
    return determinant >= _FLAT * xx * yy * one, plane, normal


@kernel("UniTuple(f8, 2)(f8[:, ::1], f8[::1], b1[:, ::1], f8[::1], i8)")
def residual_squares(design, inverse, component, plane, block):
    """Sum of the squares of residuals [1/m^2] over the component, and of their sums over blocks of so many samples.

    Residuals that hold together add up in the latter.
    """
    rows, columns = component.shape
    residual = np.zeros((rows, columns))
    total = blocks = 0.0
    for r in range(rows):
        for c in range(columns):
            if component[r, c]:
                i = r * columns + c
                at = design[i, 0] * plane[0] + design[i, 1] * plane[1] + design[i, 2] * plane[2]
                residual[r, c] = inverse[i] - at
                total += residual[r, c] * residual[r, c]
    for top in range(0, rows - block + 1, block):
        for left in range(0, columns - block + 1, block):
            together = 0.0
            for r in range(top, top + block):
                for c in range(left, left + block):
                    together += residual[r, c]
            blocks += together * together
    return total, blocks


@dataclass(frozen=True, kw_only=True)
class SurfaceRegion:
    """The surface in one picture."""

    plane: PlaneEstimate  # its plane
    cells: np.ndarray  # samples on it by depth, bool (rows, columns)
    colored: np.ndarray  # those of them that have its colour, bool (rows, columns)
    color: np.ndarray  # its colour where nothing is printed or painted on it, RGB (3,)
    # whether colour or light separate it from a wall at its depth; `cells` are without the wall then
    by_color: bool = False
    shadowed: bool = False  # whether shadows lie on it; `colored` is with those samples

    def end_band(self, width: int) -> np.ndarray:
        """Samples within so many cells of the surface's end, by depth or by colour, bool (rows, columns)."""
        kernel = np.ones((2 * width + 1, 2 * width + 1), np.uint8)
        band = np.zeros(self.cells.shape, bool)
        for whole in (filled(self.cells), self.whole):
            band |= (cv2.dilate(whole, kernel) > 0) & (cv2.erode(whole, kernel, borderValue=1) == 0)
        return band

    @cached_property
    def whole(self) -> np.ndarray:
        """The surface by colour without holes, uint8 (rows, columns)."""
        return filled(self.colored)


def depth_gate(plane: PlaneEstimate) -> float:
    """Fraction of depth within which a reading is on the surface."""
    return min(max(_GATE_SIGMAS * plane.residual_sigma, _GATE_LOW), _GATE_HIGH)


def samples_on(picture: Picture, plane: PlaneEstimate, seed: tuple[int, int]) -> np.ndarray:
    """Connected samples on a plane by depth alone, bool (rows, columns)."""
    grid, inverse = picture.grid, picture.inverse
    predicted = np.maximum((grid.design @ plane.inverse_depth).reshape(grid.shape), 1e-6)
    relative = np.where(inverse > 0.0, inverse / predicted - 1.0, np.inf)
    cells = connected_samples(np.abs(relative) < depth_gate(plane), grid, seed)
    return cells if cells.any() or plane.component.shape != cells.shape else plane.component


def shaded_samples(
    picture: Picture, plane: np.ndarray, cells: np.ndarray, lit: np.ndarray, color: np.ndarray
) -> np.ndarray | None:
    """Samples of the surface in other light, where a shadow falls on it; None without a shadow.

    Colour alone does not separate a shadow from a grey wall behind a white board, but that has a step of depth.

    Args:
        picture: The picture.
        plane: (a, b, c) of the surface [1/m].
        cells: Samples on it by depth, bool (rows, columns).
        lit: Samples of its colour, bool (rows, columns).
        color: This colour, RGB (3,).
    """
    lit = cells & lit
    shaded = cells & ~lit & shaded_colors(picture.colors, color)
    if int(np.count_nonzero(shaded)) < _SHADED_SHARE * int(np.count_nonzero(cells)):
        return None
    near = np.ones((2 * _NEAR_SHADE + 1, 2 * _NEAR_SHADE + 1), np.uint8)
    edges = (one & (cv2.dilate(two.view(np.uint8), near) > 0) for one, two in ((shaded, lit), (lit, shaded)))
    relative = picture.inverse.reshape(-1) / np.maximum(picture.grid.design @ plane, _FARTHEST)
    dark, bright = (relative[edge.reshape(-1)] for edge in edges)
    if min(len(dark), len(bright)) < _LEAST_EDGE or abs(float(dark.mean() - bright.mean())) > _SHADE_STEP:
        return None
    return shaded


def middle_cell(cells: np.ndarray) -> tuple[int, int]:
    """The sample of a region that lies deepest within it."""
    depth = cv2.distanceTransform(cells.astype(np.uint8), cv2.DIST_L1, 3)
    row, column = np.unravel_index(int(np.argmax(depth)), cells.shape)
    return int(row), int(column)


def filled(region: np.ndarray) -> np.ndarray:
    """The region without the holes that prints and missing depth leave in it, uint8."""
    closed = cv2.morphologyEx(region.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8))
    outlines, _ = cv2.findContours(closed, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    filled = np.zeros_like(closed)
    if outlines:
        cv2.drawContours(filled, [max(outlines, key=cv2.contourArea)], -1, 1, -1)
    return np.maximum(filled, closed)


def connected(region: np.ndarray, grid: CoarseGrid, seed: tuple[int, int]) -> np.ndarray:
    """The part of a region of samples that hangs together with a seed, gaps of one sample bridged."""
    closed = cv2.morphologyEx(region.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8)) > 0
    return connected_samples(closed, grid, seed) & region


def on_surface(picture: Picture, plane: np.ndarray, gate: float, places: np.ndarray) -> np.ndarray:
    """Those of flat places of samples, (n,), that lie on a surface by depth alone, of any colour.

    The surface is (a, b, c) of 1/Z = a x + b y + c [1/m], the gate a fraction of depth.
    """
    u, v = (axis.take(places) for axis in picture.grid.pixels)
    z, design = picture.depth[v, u], picture.grid.design.take(places, axis=0)
    return places[np.abs(z * (design @ plane) - 1.0) < gate]  # false for NaN and for no reading
