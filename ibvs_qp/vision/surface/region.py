"""The surface as the picture shows it: which samples are its own, where it ends, and which colour it has."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from ibvs_qp.vision.picture.grid import CoarseGrid, Samples
from ibvs_qp.vision.surface.plane import PlaneEstimate, connected_samples

#: A reading within this fraction of depth is on the surface at least and at most; three sigmas of the fit between.
_GATE_LOW, _GATE_HIGH, _GATE_SIGMAS = 0.010, 0.022, 3.0


@dataclass(frozen=True, kw_only=True)
class SurfaceRegion:
    """The surface in one picture."""

    grid: CoarseGrid  # coarse grid of the picture
    plane: PlaneEstimate  # its plane
    cells: np.ndarray  # samples on it by depth, bool (rows, columns)
    colored: np.ndarray  # those of them that have its colour, bool (rows, columns)
    color: np.ndarray  # its colour where nothing is printed or painted on it, RGB (3,)
    # whether colour or light separate it from a wall at its depth; `cells` are without the wall then
    by_color: bool = False

    def end_band(self, width: int) -> np.ndarray:
        """Samples within so many cells of the surface's end, by depth or by colour, bool (rows, columns)."""
        kernel = np.ones((2 * width + 1, 2 * width + 1), np.uint8)
        band = np.zeros(self.cells.shape, bool)
        for region in (self.cells, self.colored):
            whole = filled(region)
            band |= (cv2.dilate(whole, kernel) > 0) & (cv2.erode(whole, kernel, borderValue=1) == 0)
        return band


def depth_gate(plane: PlaneEstimate) -> float:
    """Fraction of depth within which a reading is on the surface."""
    return min(max(_GATE_SIGMAS * plane.residual_sigma, _GATE_LOW), _GATE_HIGH)


def samples_on(samples: Samples, plane: PlaneEstimate, seed: tuple[int, int]) -> np.ndarray:
    """Connected samples on a plane by depth alone, bool (rows, columns)."""
    grid, inverse = samples.grid, samples.inverse
    predicted = np.maximum((grid.design @ plane.inverse_depth).reshape(grid.shape), 1e-6)
    relative = np.where(inverse > 0.0, inverse / predicted - 1.0, np.inf)
    cells = connected_samples(np.abs(relative) < depth_gate(plane), grid, seed)
    return cells if cells.any() or plane.component.shape != cells.shape else plane.component


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
