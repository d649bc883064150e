"""Refits of the surface by machine code: fills in the tables of native/planes.c and reads them."""

from __future__ import annotations

import ctypes
import math

import numpy as np

from ibvs_qp.vision.colors import SurfaceColors
from ibvs_qp.vision.config import PlaneConfig
from ibvs_qp.vision.grid import CoarseGrid
from ibvs_qp.vision.native import place
from ibvs_qp.vision.surface import PlaneEstimate, surface_problem

#: Numbers in a `Surface` of planes.c: plane, inverse of the normal matrix, and five more.
_SURFACE = 17
#: What is wrong, in the order of planes.c; the last is memory, and numpy tells what is then wrong.
_PROBLEMS = (
    "",
    "too few samples on the surface",
    "too few valid depth samples",
    "samples on the surface lie on one line",
)


class Refit:
    """A surface refitted by machine code.

    Attributes:
        plane: (a, b, c), (3,).
        count: Samples of the surface.
        usable: Valid samples.
        sigma: Standard deviation of the residuals, share of depth.
        component: Samples of the surface, bool (rows, columns).
    """

    def __init__(self, numbers: np.ndarray, component: np.ndarray) -> None:
        self.plane, self.component = numbers[:3], component
        self._inverse_normal = numbers[3:12].reshape(3, 3)
        self.count, self.usable, self._total, self._blocks, self.sigma = numbers[12:].tolist()

    def covariance(self, common_mode_m: float) -> np.ndarray:
        """Least-squares covariance, inflated by the correlation of the residuals over blocks, plus the common mode."""
        inflation = max(1.0, self._blocks / self._total) if self._total > 0.0 else 1.0
        variance = self._total / max(self.count - 3.0, 1.0) * inflation
        common = common_mode_m**2 * float(self.plane @ self.plane)
        return self._inverse_normal * variance + self.plane[:, None] * self.plane * common


def estimate_of(refit: Refit, down: np.ndarray | None, config: PlaneConfig) -> PlaneEstimate | str:
    """The surface as the machine code found it, or why it cannot be one; ``down`` is gravity's direction in C, (3,)."""
    problem = surface_problem(refit.plane, down, config)
    if problem is not None:
        return problem
    length = math.hypot(*refit.plane.tolist())
    return PlaneEstimate(
        inverse_depth=refit.plane,
        covariance=refit.covariance(config.common_mode_m),
        normal=refit.plane * (-1.0 / length),
        distance_m=1.0 / length,
        inlier_share=refit.count / max(refit.usable, 1.0),
        residual_sigma=refit.sigma,
        component=refit.component,
    )


class NativePlane:
    """Refits on one grid.

    Args:
        library: The machine code.
        config: Settings.
        grid: Where the samples lie.
        design: Columns x, y, 1 of the samples, normalised, (rows * columns, 3).
        least: Fewest samples of a surface.
        block: Side of the blocks over which residuals are averaged [samples].
        paint_gates: Gate of what looks like paint in either round, share of the board's.
    """

    def __init__(
        self,
        library: ctypes.CDLL,
        config: PlaneConfig,
        grid: CoarseGrid,
        design: np.ndarray,
        least: int,
        block: int,
        paint_gates: tuple[float, float],
    ) -> None:
        self._library, self._config, self._shape = library, config, grid.shape
        self._grid = np.array(
            (*grid.shape, block, least, config.coarse_gate, 0.0, 0.0, 0.0, 0.0, *paint_gates, 0.0, -1.0)
        )
        self._grid[6:9] = config.fine_gate_sigmas, config.fine_gate_low, config.fine_gate_high
        self._design, self._free = np.ascontiguousarray(design), np.ascontiguousarray(grid.free)
        self._places = grid.places
        self._corners = np.ascontiguousarray(grid.places - np.int16(1))
        self._fixed = [place(part) for part in (self._grid, self._design, self._free)]

    def means(self, depth: np.ndarray) -> np.ndarray:
        """1/Z of the means of four neighbours at the samples [1/m], 0 without a reading in range, (rows, columns)."""
        depth, inverse = np.ascontiguousarray(depth, np.float32), np.empty(self._shape)
        self._library.sample_means(
            place(depth),
            ctypes.c_long(depth.shape[0]),
            ctypes.c_long(depth.shape[1]),
            place(self._corners),
            self._fixed[2],
            ctypes.c_long(inverse.size),
            ctypes.c_double(self._config.distance_min_m),
            ctypes.c_double(self._config.distance_max_m),
            place(inverse),
        )
        return inverse

    def labels(self, rgb: np.ndarray, colors: SurfaceColors) -> np.ndarray:
        """Labels of the samples' colours, uint8 (rows, columns); the board must be known."""
        rgb, labels = np.ascontiguousarray(rgb), np.empty(self._shape, np.uint8)
        self._library.sample_labels(
            place(rgb),
            ctypes.c_long(rgb.shape[1]),
            place(self._places),
            ctypes.c_long(labels.size),
            place(colors.levels),
            place(colors.table()),
            place(labels),
        )
        return labels

    def refit(
        self,
        inverse: np.ndarray,
        labels: np.ndarray | None,
        start: np.ndarray,
        *,
        sigma: float | None = None,
        seed: tuple[int, int] | None = None,
    ) -> Refit | str | None:
        """Two rounds of gated least squares.

        Args:
            inverse: 1/Z of the samples [1/m], 0 where absent, (rows, columns).
            labels: Colour labels of the samples, uint8 (rows, columns), or None.
            start: (a, b, c) to start from, (3,).
            sigma: Spread of the residuals that sets the last gate, share of depth; None measures it.
            seed: The surface is the part around this sample; None takes the largest.

        Returns:
            The surface, the reason why there is none, or None when memory ran out.
        """
        self._grid[5], self._grid[11] = sigma or 0.0, sigma is None
        self._grid[12] = -1.0 if seed is None else seed[0] * self._shape[1] + seed[1]
        inverse, start = np.ascontiguousarray(inverse, float), np.ascontiguousarray(start, float)
        labels = None if labels is None else np.ascontiguousarray(labels)
        component, found = np.empty(self._shape, np.uint8), np.empty(_SURFACE)
        grid, design, free = self._fixed
        problem = self._library.refit_plane(
            grid,
            design,
            place(inverse),
            place(labels),
            free,
            place(start),
            place(component),
            place(found),
        )
        if problem:
            return _PROBLEMS[problem] if problem < len(_PROBLEMS) else None
        return Refit(found, component.view(bool))
