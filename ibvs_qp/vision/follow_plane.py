"""The surface followed from picture to picture: few samples, gates known from before, no search."""

from __future__ import annotations

import math

import cv2
import numpy as np

from ibvs_qp.vision.colors import BOARD, PAINT, SurfaceColors
from ibvs_qp.vision.config import PlaneConfig
from ibvs_qp.vision.grid import CoarseGrid
from ibvs_qp.vision.native import native
from ibvs_qp.vision.native_plane import NativePlane, Refit, estimate_of
from ibvs_qp.vision.normal_equations import solve_three
from ibvs_qp.vision.robust import MAD_TO_SIGMA, median
from ibvs_qp.vision.surface import PlaneEstimate, connected_samples, surface_problem

#: Samples per row against the grid of the search: the noise holds together over 20 px of 640, so that the mean of four
#: neighbours every 16 px tells as much as one reading every 8 px.
_SPARSER = 2
#: Gate of what looks like paint, share of the board's: the half of the first gate (1.25 % of depth), and more than two
#: sigmas of the last one, lie well within a gap of 0.02 m at 0.5 m (4 %).
_PAINT_GATES = (0.5, 0.75)
#: Halfway to the next pixel along both axes, as OpenCV counts fractions of a pixel: in 32nds, 32 rows of them.
_HALFWAY = 32 * 16 + 16
#: Side of the blocks over which residuals are averaged to measure their correlation [samples].
_BLOCK = 4
#: Smallest determinant of the normal matrix, share of the product of its diagonal.
_FLAT = 1e-6


class PlaneFollower:
    """Refits a surface around its prediction on the samples of one picture size and camera."""

    def __init__(
        self,
        config: PlaneConfig,
        shape: tuple[int, int],
        intrinsics: tuple[float, float, float, float],
        mask: np.ndarray,
    ) -> None:
        """Lay the samples over a picture of (height, width) [px] with its vehicle mask."""
        self._config = config
        self._grid = grid = CoarseGrid(shape, intrinsics, mask, config.grid_columns // _SPARSER)
        self._least = max(config.min_samples // _SPARSER**2, 3)
        self._free = grid.free.ravel()
        fx, fy, _, _ = intrinsics
        # the mean of four neighbours stands for the corner between them
        self._design = design = grid.design - (0.5 / fx, 0.5 / fy, 0.0)
        x, y, one = design.T
        self._products = np.column_stack((x * x, x * y, x, y * y, y, one))
        self._before = grid.places - np.int16(1)
        self._between = np.full(grid.shape, _HALFWAY, np.uint16)
        rows, columns = (size // _BLOCK for size in grid.shape)
        self._blocks = rows, columns
        self._pixels = grid.pixels
        library = native()
        self._native = (
            None if library is None else NativePlane(library, config, grid, design, self._least, _BLOCK, _PAINT_GATES)
        )

    def follow(
        self,
        rgb: np.ndarray,
        depth: np.ndarray,
        predicted: np.ndarray,
        sigma: float,
        colors: SurfaceColors,
        down: np.ndarray | None,
    ) -> PlaneEstimate | str:
        """Refit the surface.

        Args:
            rgb: Colour, uint8 (H, W, 3).
            depth: Depth [m], (H, W).
            predicted: (a, b, c) of 1/Z = a x + b y + c as predicted into this picture, (3,).
            sigma: Standard deviation of the residuals in the picture before, share of depth.
            colors: What the surface looks like.
            down: Gravity's direction in C, unit, (3,), or None if unknown.

        Returns:
            The surface, its component on this grid, or the reason why there is none.
        """
        if self._native is not None:
            labels = None if colors.board is None else self._native.labels(rgb, colors)
            refit = self._native.refit(self._native.means(depth), labels, predicted, sigma=sigma)
            if refit is not None:
                return estimate_of(refit, down, self._config) if isinstance(refit, Refit) else refit
        return self.follow_with_numpy(rgb, depth, predicted, sigma, colors, down)

    def follow_with_numpy(
        self,
        rgb: np.ndarray,
        depth: np.ndarray,
        predicted: np.ndarray,
        sigma: float,
        colors: SurfaceColors,
        down: np.ndarray | None,
    ) -> PlaneEstimate | str:
        """The same where there is no machine code, and to say what it computes."""
        config, grid, design = self._config, self._grid, self._design
        z = self._means(depth)
        usable = self._free & (z > config.distance_min_m) & (z < config.distance_max_m)  # false for NaN too
        board = paint = None
        if colors.board is not None:
            labels = colors.label(grid.sample(rgb), colors.levels_at(*self._pixels)).reshape(-1)
            board, paint = labels == BOARD, labels == PAINT
        z[~usable] = 1.0
        inverse = 1.0 / z
        plane, gate, first, spread, normal_matrix = predicted, config.coarse_gate, usable, self._free, np.eye(3)
        for last in (False, True):
            size = np.abs(z * (design @ plane) - 1.0)
            chosen = usable & (size < gate)
            if board is not None and paint is not None:
                # a wall that looks like paint must not get in: what looks like it has to fit better
                colored = chosen & (board | (paint & (size < _PAINT_GATES[last] * gate)))
                chosen = colored if int(np.count_nonzero(colored)) >= self._least else chosen
            if last:
                spread = size.take(np.flatnonzero(first))
                chosen = connected_samples(chosen.reshape(grid.shape), grid, None).reshape(-1)
            else:
                first = chosen  # before the last gate, which would make their spread look smaller
            weight = chosen.astype(np.float64)
            xx, xy, x, yy, y, count = sums = (weight @ self._products).tolist()
            if count < self._least:
                return "too few samples on the surface"
            wanted = ((weight * inverse) @ design).tolist()
            solved = solve_three(sums, wanted)
            if solved is None or solved[1] < _FLAT * xx * yy * count:
                return "samples on the surface lie on one line"
            plane = np.array(solved[0])
            normal_matrix = np.array(((xx, xy, x), (xy, yy, y), (x, y, count)))
            gate = min(max(config.fine_gate_sigmas * sigma, config.fine_gate_low), config.fine_gate_high)
        problem = surface_problem(plane, down, config)
        if problem is not None:
            return problem
        length = math.hypot(*plane.tolist())
        residual = weight * (inverse - design @ plane)
        return PlaneEstimate(
            inverse_depth=plane,
            covariance=self._covariance(residual, normal_matrix, count, plane),
            normal=-plane / length,
            distance_m=1.0 / length,
            inlier_share=count / max(int(np.count_nonzero(usable)), 1),
            residual_sigma=MAD_TO_SIGMA * median(spread),
            component=chosen.reshape(grid.shape),
        )

    def _means(self, depth: np.ndarray) -> np.ndarray:
        """Mean of four neighbours at every sample [m], (n,); one without a reading pulls it far off the surface."""
        depth = depth.astype(np.float32, copy=False)
        means = cv2.remap(depth, self._before, self._between, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        return means.reshape(-1).astype(np.float64)

    def _covariance(
        self, residual: np.ndarray, normal_matrix: np.ndarray, count: float, plane: np.ndarray
    ) -> np.ndarray:
        """Least-squares covariance, inflated by the correlation of the residuals over blocks, plus the common mode."""
        rows, columns = self._blocks
        square = residual.reshape(self._grid.shape)[: rows * _BLOCK, : columns * _BLOCK]
        sums = square.reshape(rows, _BLOCK, columns, _BLOCK).sum(axis=(1, 3))
        total = float(residual @ residual)
        inflation = max(1.0, float(np.vdot(sums, sums)) / total) if total > 0 else 1.0
        variance = total / max(count - 3.0, 1.0) * inflation
        common = self._config.common_mode_m**2 * float(plane @ plane)
        return np.linalg.inv(normal_matrix) * variance + plane[:, None] * plane * common
