"""The surface followed from picture to picture: few samples, gates known from before, no search."""

from __future__ import annotations

import numpy as np

from ibvs_qp.vision.appearance.colors import SurfaceColors
from ibvs_qp.vision.config import PlaneConfig
from ibvs_qp.vision.kernels.labels import sample_labels
from ibvs_qp.vision.kernels.samples import sample_means
from ibvs_qp.vision.picture.grid import CoarseGrid
from ibvs_qp.vision.surface.estimate import PlaneEstimate
from ibvs_qp.vision.surface.refit_plane import PlaneRefit

#: Samples per row against the grid of the search: the noise holds together over 20 px of 640, so that the mean of four
#: neighbours every 16 px tells as much as one reading every 8 px.
_SPARSER = 2
#: Gate of what looks like paint, share of the board's: the half of the first gate (1.25 % of depth), and more than two
#: sigmas of the last one, lie well within a gap of 0.02 m at 0.5 m (4 %).
_PAINT_GATES = (0.5, 0.75)
#: Side of the blocks over which residuals are averaged to measure their correlation [samples].
_BLOCK = 4


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
        fx, fy, _, _ = intrinsics
        # the mean of four neighbours stands for the corner between them
        design = grid.design - (0.5 / fx, 0.5 / fy, 0.0)
        least = max(config.min_samples // _SPARSER**2, 3)
        self._refit = PlaneRefit(config, grid, design, least=least, block=_BLOCK, paint_gates=_PAINT_GATES)

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
        labels = None if colors.board is None else self._labels(rgb, colors)
        return self._refit.refit(self._means(depth), labels, predicted, down, sigma=sigma)

    def _means(self, depth: np.ndarray) -> np.ndarray:
        """1/Z of the means of four neighbours at the samples [1/m], 0 without a reading in range, (rows, columns)."""
        grid, config = self._grid, self._config
        depth, inverse = np.ascontiguousarray(depth, np.float32), np.empty(grid.shape)
        nearest, farthest = float(config.distance_min_m), float(config.distance_max_m)
        places, free = grid.places.reshape(-1, 2), grid.free.reshape(-1)
        sample_means(depth, places, free, nearest, farthest, inverse.reshape(-1))
        return inverse

    def _labels(self, rgb: np.ndarray, colors: SurfaceColors) -> np.ndarray:
        """Labels of the samples' colours, uint8 (rows, columns); the board must be known."""
        labels = np.empty(self._grid.shape, np.uint8)
        rgb, places = np.ascontiguousarray(rgb), self._grid.places.reshape(-1, 2)
        sample_labels(rgb, places, colors.levels, colors.table(), labels.reshape(-1))
        return labels
